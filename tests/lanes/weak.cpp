// What lanes/shared must refuse: the linker keeps one std::max for the whole program.
#include <algorithm>

const int& (*greater)(const int&, const int&) = std::max<int>;
