// What the learner's products of matrices take, beside Eigen's of the same sizes.
//   learner_kernels
// Prints for each product the nanoseconds of each instruction set that this CPU has, those of Eigen, and the ratio of
// Eigen's to the last. Each is the median of many short measurements of CPU time that alternate. Eigen is compiled for this CPU and
// without fused multiply-add, because the learner's bits must not depend on it; Eigen adds in an order of its own.
#include <Eigen/Dense>
#include <cstdio>
#include <functional>
#include <string>
#include <vector>

#include "kernels/kernels.hpp"
#include "measure.hpp"

namespace {

using namespace mjenv::learn;
using Matrix = Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

constexpr int kRows = 64, kSamples = 301, kCalls = 50;

struct Way {
  std::string name;
  std::function<void()> call;
  std::vector<double> nanoseconds;  // of one call
};

void compare(const std::string& what, std::vector<Way> ways) {
  for (int sample = 0; sample < kSamples; ++sample)
    for (Way& way : ways)
      way.nanoseconds.push_back(1e9 / kCalls * measure::seconds([&] {
                                  for (int i = 0; i < kCalls; ++i) way.call();
                                }));
  std::printf("%-20s", what.c_str());
  for (const Way& way : ways) std::printf("  %s %7.0f ns", way.name.c_str(), measure::median(way.nanoseconds));
  const auto& ours = ways[ways.size() - 2].nanoseconds;
  std::printf("  ratio %.2f\n", measure::median(ways.back().nanoseconds) / measure::median(ours));
}

void compare_sizes(int inputs, int outputs) {
  const Matrix x = Matrix::Random(kRows, inputs), w = Matrix::Random(inputs, outputs);
  const Eigen::RowVectorXf bias = Eigen::RowVectorXf::Random(outputs);
  Matrix y(kRows, outputs), g = Matrix::Zero(inputs, outputs);
  Eigen::RowVectorXf h = Eigen::RowVectorXf::Zero(outputs);
  std::vector<Way> products, gradients;
  for (const Kernels* kernels : usable_kernels()) {
    products.push_back(
        {kernels->name,
         [&, kernels] { kernels->product(x.data(), inputs, kRows, inputs, w.data(), outputs, bias.data(), y.data()); },
         {}});
    gradients.push_back({kernels->name,
                         [&, kernels] {
                           kernels->gradient(x.data(), inputs, kRows, inputs, y.data(), outputs, true, g.data());
                           kernels->sum_rows(y.data(), kRows, outputs, true, h.data());
                         },
                         {}});
  }
  products.push_back({"Eigen", [&] { y.noalias() = (x * w).rowwise() + bias; }, {}});
  gradients.push_back({"Eigen",
                       [&] {
                         g.noalias() += x.transpose() * y;
                         h += y.colwise().sum();
                       },
                       {}});
  const std::string sizes = std::to_string(inputs) + " to " + std::to_string(outputs);
  compare("product, " + sizes, std::move(products));
  compare("gradient, " + sizes, std::move(gradients));
}

}  // namespace

int main() {
  std::printf("%s, %d rows\n", measure::cpu().c_str(), kRows);
  for (const int inputs : {20, 64, 348}) compare_sizes(inputs, 64);  // HalfCheetah, a hidden layer, Humanoid
  compare_sizes(64, 16);
}
