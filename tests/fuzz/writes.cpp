// Writes to the models and inputs of rows, with any values, and what resets and steps draw, from any distributions; and
// images of rows that have arrays of their own, damaged with a checksum that fits. What is refused leaves every row as
// it was; what is written can be read.
#include <array>
#include <cmath>
#include <limits>
#include <string>

#include "target.hpp"

namespace {

constexpr std::int64_t kRows = 3;

// A bit of everything whose arrays can be written.
const char* const kModel = R"(<mujoco><size nuserdata="3"/><option timestep="0.005" density="1" viscosity="0.01"/>
<asset><hfield name="hills" nrow="3" ncol="4" size="1 1 .2 .1"/>
<mesh name="tetra" vertex="0 0 0 .1 0 0 0 .1 0 0 0 .1"/><material name="grey" rgba=".5 .5 .5 1"/></asset>
<worldbody><light pos="0 0 3"/><camera name="eye" pos="0 -3 1"/>
<geom name="floor" type="plane" size="9 9 1" material="grey"/><geom type="hfield" hfield="hills" pos="3 0 0"/>
<body name="ghost" mocap="true" pos="1 1 1"><geom size=".1" contype="0" conaffinity="0"/></body>
<body name="crate" pos="0 0 .3"><freejoint/><geom type="box" size=".1 .1 .1"/><geom type="mesh" mesh="tetra"/>
<body pos="0 0 .2"><joint name="a" type="hinge" axis="0 1 0" range="-1 1" limited="true" stiffness="1"/>
<geom type="capsule" fromto="0 0 0 .2 0 0" size=".03"/><site name="tip" pos=".2 0 0"/>
<body pos=".2 0 0"><joint name="b" type="ball" damping=".1"/><geom type="ellipsoid" size=".05 .04 .03"/></body></body>
</body><body pos="0 1 .5"><joint name="c" type="slide" axis="0 0 1" frictionloss=".1"/><geom type="cylinder" size=".1 .1"/>
<site name="top"/></body></worldbody>
<tendon><spatial name="rope" range="0 3" limited="true"><site site="tip"/><site site="top"/></spatial>
<fixed name="sum"><joint joint="a" coef="1"/><joint joint="c" coef="-1"/></fixed></tendon>
<equality><joint joint1="a" joint2="c" active="false"/><weld body1="crate" body2="ghost" active="false"/></equality>
<actuator><motor joint="a" ctrllimited="true" ctrlrange="-1 1"/><position joint="c" kp="5"/>
<general joint="c" dyntype="filter" dynprm=".1"/></actuator>
<sensor><framepos objtype="site" objname="tip"/></sensor></mujoco>)";

EnvHandle env_of(std::size_t kind, std::int64_t threads) {
  static const char* const ids[] = {"Model-v0", "Ant-v5", "Hopper-v4", "Reacher-v5"};
  const OptionsHandle options = options_of(ids[kind]);
  REQUIRE(mjenv_options_set_integer(options.get(), "strict", 0) == MJENV_OK);
  REQUIRE(mjenv_options_set_integer(options.get(), "num_threads", threads) == MJENV_OK);
  if (kind == 0) REQUIRE(mjenv_options_set_string(options.get(), "xml_string", kModel) == MJENV_OK);
  EnvHandle env = create(options, kRows);
  REQUIRE(env);
  return env;
}

std::vector<std::string> array_names(const mjenv_env* env) {
  std::vector<std::string> names{"", "no_such_array", "draws[0]", "draws[1]"};
  for (const mjenv_role role : {MJENV_ROLE_MODEL, MJENV_ROLE_DATA})
    for (std::int64_t i = 0; i < mjenv_field_count(env, role); ++i) {
      mjenv_field field = MJENV_FIELD_INIT;
      REQUIRE(mjenv_field_at(env, role, i, &field) == MJENV_OK);
      names.emplace_back(field.name);
    }
  return names;
}

bool same_bits(const std::vector<double>& a, const std::vector<double>& b) {
  return a.size() == b.size() && (a.empty() || std::memcmp(a.data(), b.data(), a.size() * sizeof a[0]) == 0);
}

class Writes {
 public:
  explicit Writes(Bytes bytes)
      : bytes_(bytes),
        env_(env_of(bytes_.below(4), static_cast<std::int64_t>(1 + bytes_.below(2)))),
        out_(env_.get(), kRows),
        names_(array_names(env_.get())),
        actuators_(static_cast<std::size_t>(mjenv_field_count(env_.get(), MJENV_ROLE_ACTION))) {}

  void run() {
    for (int calls = 0; calls < 40 && bytes_.left() > 0; ++calls) call();
    check(mjenv_reset(env_.get(), nullptr, nullptr));
    step();
  }

 private:
  Bytes bytes_;
  EnvHandle env_;
  Outputs out_;
  std::vector<std::string> names_;
  std::size_t actuators_;

  void call() {
    switch (bytes_.below(12)) {
      case 0: check(mjenv_set_constants_row(env_.get(), row())); break;
      case 1: check(mjenv_reset(env_.get(), nullptr, &out_.batch)); break;
      case 2: step(); break;
      case 3: send(); break;
      case 4: image(); break;
      case 5: copy(); break;
      case 6: set_state(); break;
      case 7:
      case 8: write_rows(); break;
      case 9: randomize(); break;
      case 10: perturb(); break;
      default: write_row(); break;
    }
  }

  // Mostly one that there is.
  std::int64_t row() { return static_cast<std::int64_t>(bytes_.below(kRows + 3)) - 2; }
  std::string name() {
    return bytes_.below(20) == 0 ? bytes_.text(20) : names_[bytes_.take<std::uint16_t>() % names_.size()];
  }

  double value(double old) {
    constexpr double kInfinity = std::numeric_limits<double>::infinity();
    static const double special[] = {0,      -0.0, 1,   -1,           0.5,       2,     3,      1e-300,
                                     1e-15,  1e-6, 1e3, 1e10,         1e39,      1e300, -1e300, kInfinity,
                                     5e-324, 1e-3, -10, 2147483648.0, -kInfinity};
    switch (bytes_.below(5)) {
      case 0: return old * bytes_.one_of(special);
      case 1: return old + bytes_.one_of(special);
      case 2: return bytes_.take<double>();
      case 3: return std::numeric_limits<double>::quiet_NaN();
      default: return bytes_.one_of(special);
    }
  }

  std::vector<double> changed(std::vector<double> values) {
    for (std::size_t changes = bytes_.below(6); changes > 0 && !values.empty(); --changes) {
      double& chosen = values[bytes_.take<std::uint16_t>() % values.size()];
      chosen = value(chosen);
    }
    if (bytes_.below(20) == 0) values.resize(bytes_.below(40));
    return values;
  }

  // A row's array; nothing if there is none, or if MuJoCo fails to compute it.
  std::vector<double> read(std::int64_t row, const std::string& array) {
    std::int64_t count = 0;
    if (check(mjenv_read(env_.get(), row, array.c_str(), nullptr, 0, &count)) != MJENV_OK) return {};
    std::vector<double> values(count);
    if (check(mjenv_read(env_.get(), row, array.c_str(), values.data(), count, &count)) != MJENV_OK) return {};
    return values;
  }
  std::vector<std::vector<double>> read_all(const std::string& array) {
    std::vector<std::vector<double>> rows;
    for (std::int64_t i = 0; i < kRows; ++i) rows.push_back(read(i, array));
    return rows;
  }

  static void require_written(const std::vector<double>& read, const double* values) {
    for (std::size_t i = 0; i < read.size(); ++i)
      REQUIRE(read[i] == values[i] || read[i] == static_cast<double>(static_cast<float>(values[i])));
  }

  // A mask of one row, or of none; null for all rows.
  void write_row() {
    const std::string array = name();
    const std::int64_t target = row();
    const auto before = read_all(array);
    const std::vector<double> values =
        changed(before[target > 0 && target < kRows ? static_cast<std::size_t>(target) : 0]);
    const auto count = static_cast<std::int64_t>(values.size());
    const mjenv_status status =
        check(target == MJENV_ALL_ROWS ? mjenv_write(env_.get(), nullptr, array.c_str(), values.data(), count)
                                       : mjenv_write_row(env_.get(), target, array.c_str(), values.data(), count));
    const auto after = read_all(array);
    for (std::size_t i = 0; i < before.size(); ++i) {
      const bool is_written =
          status == MJENV_OK && (target == MJENV_ALL_ROWS || target == static_cast<std::int64_t>(i));
      // As many values as all rows have are each row's own.
      const std::size_t own = values.size() > before[i].size() ? i * before[i].size() : 0;
      if (is_written)
        require_written(after[i], values.data() + own);
      else
        REQUIRE(before[i].empty() || same_bits(before[i], after[i]));
    }
  }

  void write_rows() {
    const std::string array = name();
    const auto before = read_all(array);
    std::vector<double> values;
    for (const auto& one : before) values.insert(values.end(), one.begin(), one.end());
    values = changed(values);
    std::vector<std::uint8_t> mask = bytes_.list<std::uint8_t>(kRows);
    for (std::uint8_t& chosen : mask) chosen &= 1;
    const bool all = bytes_.flag();
    const mjenv_status status =
        check(mjenv_write(env_.get(), all ? nullptr : mask.data(), array.c_str(), values.data(), values.size()));
    const auto after = read_all(array);
    const std::size_t each = values.size() / kRows;
    for (std::size_t i = 0; i < before.size(); ++i)
      if (status == MJENV_OK && (all || mask[i] != 0))
        require_written(after[i], values.data() + i * each);
      else
        REQUIRE(before[i].empty() || same_bits(before[i], after[i]));
  }

  // Calls what replaces a setting. If it is refused, images stay the same.
  template <typename Call>
  void replace(const Call& call) {
    const std::vector<unsigned char> before = image_of(env_.get(), MJENV_ALL_ROWS);
    REQUIRE(check(call()) == MJENV_OK || image_of(env_.get(), MJENV_ALL_ROWS) == before);
  }

  std::vector<double> some_values(std::size_t most) {
    std::vector<double> values(bytes_.below(most + 1));
    for (double& each : values) each = value(1);
    return values;
  }

  std::string numbers(std::size_t most) {
    std::string list;
    for (const double one : some_values(most)) list += (list.empty() ? "" : ",") + std::to_string(one);
    return "[" + list + "]";
  }
  std::string range() {
    const int least = bytes_.take<std::int8_t>() % 5;
    return "[" + std::to_string(least) + "," + std::to_string(least + bytes_.take<std::int8_t>() % 6) + "]";
  }
  template <std::size_t count>
  std::string one_of(const char* const (&words)[count]) {
    return words[bytes_.below(count)];
  }

  void randomize() {
    std::string draws;
    for (std::size_t count = bytes_.below(4); count > 0; --count) {
      draws += (draws.empty() ? "\"" : ",\"") + name() + R"(":{"kind":)" +
               one_of({"\"value\"", "\"scale\"", "\"offset\"", "\"same\"", "null", "1"}) + ",";
      draws += one_of({R"("low":0.5,"high":1.5)", R"("distribution":"log_uniform","low":0.5,"high":1.5)",
                       R"("distribution":"normal","mean":1,"std":1)", R"("factor":-0.5)",
                       R"("distribution":"truncated_normal","mean":1,"std":1,"low":0,"high":2)"});
      if (bytes_.below(4) == 0) draws += R"(,"choices":)" + numbers(5);
      if (bytes_.flag()) draws += R"(,"elements":)" + range();
      draws += one_of({"", R"(,"shared":true)", R"(,"set_constants":true)", R"(,"body":1)", R"(,"columns":0)"}) + "}";
    }
    set("{\"randomize\":{" + draws + "}}");
  }

  void perturb() {
    std::string pushes;
    for (std::size_t count = bytes_.below(3); count > 0; --count)
      pushes += (pushes.empty() ? "" : ",") + (R"({"body":)" + std::to_string(bytes_.take<std::int8_t>() % 8)) +
                R"(,"every":)" + range() + one_of({"", R"(,"duration":2)"}) +
                one_of({R"(,"force":)", R"(,"velocity":)", R"(,"torque":)"}) + "[" + numbers(2) + ",[0,0],[0,1]]}";
    if (bytes_.below(5) == 0) return set(R"({"noise":null,"delay":null,"push":null})");
    set(R"({"noise":{"action":)" + numbers(3) + R"(,"observation":)" + numbers(2) + R"(},"delay":{"action":)" +
        range() + R"(,"observation":)" + range() + R"(,"redraw":")" + one_of({"reset", "step"}) + R"("},"push":[)" +
        pushes + "]}");
  }

  void set(const std::string& document) {
    replace([&] { return mjenv_randomize(env_.get(), document.c_str()); });
  }

  std::vector<double> actions() {
    std::vector<double> values(kRows * actuators_);
    for (double& each : values) each = static_cast<double>(bytes_.take<std::int8_t>()) / 64;
    return values;
  }

  void step() {
    const std::vector<double> action = actions();
    check(mjenv_step(env_.get(), nullptr, action.data(), action.size(), MJENV_DTYPE_FLOAT64, &out_.batch));
  }

  // Rows that are under way are not written.
  void send() {
    const std::vector<double> action = actions();
    if (check(mjenv_send(env_.get(), nullptr, 0, action.data(), action.size(), MJENV_DTYPE_FLOAT64)) != MJENV_OK)
      return;
    const double timestep = 0.001;
    REQUIRE(check(mjenv_write(env_.get(), nullptr, "opt.timestep", &timestep, 1)) == MJENV_E_PENDING);
    REQUIRE(check(mjenv_set_constants(env_.get(), nullptr)) == MJENV_E_PENDING);
    REQUIRE(check(mjenv_randomize(env_.get(), "{}")) == MJENV_E_PENDING);
    std::int64_t rows[kRows];
    std::int64_t count = 0;
    check(mjenv_recv(env_.get(), kRows, -1, rows, kRows, &count, &out_.batch));
    REQUIRE(count == kRows);
  }

  void image() {
    const std::int64_t from = static_cast<std::int64_t>(bytes_.below(kRows + 1)) - 1;
    const std::int64_t to = from == MJENV_ALL_ROWS ? from : static_cast<std::int64_t>(bytes_.below(kRows));
    std::vector<unsigned char> image = image_of(env_.get(), from);
    const std::vector<unsigned char> whole = image;
    for (std::size_t patches = bytes_.below(6); patches > 0; --patches) {
      // The first kilobytes hold the names, and the values of the first arrays.
      const std::size_t at =
          bytes_.take<std::uint16_t>() % (bytes_.flag() ? std::min<std::size_t>(image.size(), 400) : image.size());
      const auto patch = bytes_.list<unsigned char>(std::min<std::size_t>(bytes_.below(9), image.size() - at));
      std::copy(patch.begin(), patch.end(), image.begin() + static_cast<std::ptrdiff_t>(at));
    }
    if (bytes_.below(10) == 0) image.resize(bytes_.take<std::uint16_t>() % (image.size() + 100));
    put_checksum(image);
    const mjenv_status status = check(mjenv_restore(env_.get(), to, image.data(), image.size()));
    REQUIRE(status == MJENV_OK || image != whole);
  }

  void copy() {
    std::vector<std::uint8_t> mask = bytes_.list<std::uint8_t>(kRows);
    for (std::uint8_t& chosen : mask) chosen &= 1;
    check(mjenv_copy_row(env_.get(), mask.data(), row()));
  }

  void set_state() {
    const std::int64_t target = row();
    const std::int64_t source = target >= 0 && target < kRows ? target : 0;
    const std::vector<double> qpos = read(source, "qpos"), qvel = read(source, "qvel");
    check(mjenv_set_state(env_.get(), target, qpos.data(), qpos.size(), qvel.data(), qvel.size()));
  }
};

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  Writes(Bytes(data, size)).run();
  return 0;
}
