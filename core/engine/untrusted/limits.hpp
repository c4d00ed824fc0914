// The limits of models (docs/reliability.md). Each has a value for untrusted models, with which a model loads in
// seconds and a work space takes at most about a gigabyte, and a value for trusted ones, with which MuJoCo's
// computations of sizes do not overflow.
#pragma once

#include <cstdint>
#include <limits>
#include <string>

namespace mjenv::core {

struct Limit {
  std::int64_t untrusted, trusted;
};

// The end of a message about a model that would be accepted if it were trusted.
inline constexpr const char* kUnlessTrusted = "; if you trust the model, set the option \"trust_xml\" to \"yes\"";

inline constexpr std::int64_t kMiB = std::int64_t{1} << 20, kBillion = 1'000'000'000;
inline constexpr std::int64_t kNoLimit = std::numeric_limits<std::int64_t>::max();

// Files and XML.
inline constexpr Limit kTextBytes{16 * kMiB, 1024 * kMiB};
// MuJoCo compares the name of each object with those of all others of its kind. A model with 20,000 bodies, the slowest
// kind, takes 4 s to load, one with 50,000 six times as long; long names that begin alike are slower still.
inline constexpr Limit kElements{20'000, 10'000'000};
inline constexpr Limit kNameBytes{100, kNoLimit};
inline constexpr Limit kAttributes{200, 200};  // of an element; tinyxml2 compares each with those before it
inline constexpr Limit kTags{2 * kElements.untrusted + 1'000, 2 * kElements.trusted + 1'000};
inline constexpr Limit kLevels{100, 100};  // of nested elements; tinyxml2 has the same limit
inline constexpr Limit kFiles{1'000, 100'000};
inline constexpr Limit kFileBytes{64 * kMiB, 1024 * kMiB};
inline constexpr Limit kAllFileBytes{512 * kMiB, 8192 * kMiB};

// Meshes, images and height fields.
inline constexpr Limit kVertices{600'000, 1 << 24};
inline constexpr Limit kFaces{200'000, 1 << 24};
inline constexpr Limit kAllVertices{2'000'000, kNoLimit};
inline constexpr Limit kAllTriangles{4'000'000, kNoLimit};
// The work on convex hulls, as cmake/engine/guards.c counts it: for each hull, the square of its number of vertices;
// and whenever qhull adds a vertex, 100 for each vertex of the facets that change. This much work takes seconds.
inline constexpr Limit kHullWork{1'600'000'000, kNoLimit};
// If MuJoCo is a shared library: the largest sum, over the hulls of an untrusted model, of the cubes of their numbers
// of vertices. MuJoCo computes each hull twice; for the slowest hulls of this size, those of cones, that takes 4.4 s
// (to measure it, load a mesh of 7,900 points on a cone by mujoco.MjModel.from_xml_string).
inline constexpr std::int64_t kHullCubes = 500'000'000'000;
// For the contacts in the step with which MuJoCo tests an untrusted model, as cmake/engine/overlaps.c estimates them. To create
// an environment takes two steps' contacts more.
inline constexpr double kContactMicroseconds = 1.5e6;
inline constexpr double kMaxCoordinate = 1 << 30;  // MuJoCo's own limit, which it checks only in STL files
inline constexpr Limit kFaceCorners{256, 256};
inline constexpr Limit kPixels{1 << 26, 1 << 28};
inline constexpr Limit kAllPixels{1 << 27, 1 << 29};
inline constexpr Limit kCompressedTexts{8, 8};  // in a PNG image; lodepng unpacks each to at most 16 MB
inline constexpr Limit kChannels{4, 4};
inline constexpr Limit kTextureWidth{16'384, 16'384};
inline constexpr Limit kTextureHeight{6 * 16'384, 6 * 16'384};

// The compiled model, its work spaces, and the time of a step.
inline constexpr Limit kDofs{3'000, 100'000};
inline constexpr Limit kConstraints{10'000, kBillion};
inline constexpr Limit kNumbers{1 << 26, 1 << 28};  // in user data and keyframes
inline constexpr Limit kWorkNumbers{1 << 27, 1 << 29};
inline constexpr Limit kNumericSize{1'000'000, 1'000'000};
inline constexpr Limit kStackRows{20'000, 20'000};  // the default size of MuJoCo's stack must be an int
inline constexpr Limit kCompositeParts{2'500, 500'000};
inline constexpr Limit kSubgrid{64, 64};
inline constexpr Limit kIterations{10'000, kBillion};
inline constexpr Limit kMultiplications{kBillion, kNoLimit};
inline constexpr Limit kSearches{1'000, kBillion};  // ls_iterations, sdf_iterations and sdf_initpoints
inline constexpr Limit kArenaBytes{1024 * kMiB, 1024 * 1024 * kMiB};
inline constexpr Limit kReplicas{2'000, 100'000};    // and attachments; the time grows with the square of their number
inline constexpr Limit kReported{1'000, 1'000'000};  // contacts that one sensor reports
inline constexpr Limit kWideNumbers{1 << 20, 1 << 28};    // of sensors that have values for each pixel or vertex
inline constexpr Limit kRangeSteps{2'000'000, kBillion};  // of the simulations that find the range of muscles' lengths

// Rendering.
inline constexpr Limit kShadowSize{16'384, 16'384};
inline constexpr Limit kPictureSide{16'384, 16'384};
inline constexpr Limit kSamples{1'024, 1'024};
inline constexpr Limit kSlices{128, 1'024};

// The limits that apply to one model.
class Limits {
 public:
  explicit Limits(bool trusted) : trusted_(trusted) {}

  bool trusted() const { return trusted_; }
  std::int64_t of(const Limit& limit) const { return trusted_ ? limit.trusted : limit.untrusted; }
  // Returns the reason to refuse this count, or "" if it is within the limit.
  std::string excess(const std::string& what, std::int64_t count, const Limit& limit) const {
    if (count <= of(limit)) return "";
    const bool trust_helps = count <= limit.trusted;
    return std::to_string(count) + " " + what + "; the limit is " + std::to_string(of(limit)) +
           (trust_helps ? kUnlessTrusted : "");
  }

 private:
  bool trusted_;
};

}  // namespace mjenv::core
