// Included before all else where MJ_STATIC alone does not hide the engine: tinyxml2's header marks its classes for export.
#pragma once

#define visibility(kind)
#include <tinyxml2.h>
#undef visibility
#undef TINYXML2_LIB
#define TINYXML2_LIB
