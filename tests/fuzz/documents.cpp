// Documents of mjenv_randomize: any text. What is accepted sets itself again when it is read back, and lets rows reset
// and step; what is refused changes nothing.
#include "target.hpp"

namespace {

std::string document_of(mjenv_env* env) {
  const char* document = nullptr;
  REQUIRE(mjenv_randomization(env, &document) == MJENV_OK);
  return document;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const EnvHandle env = create(options_of("Ant-v5"), 2);
  Bytes bytes(data, size);
  const std::string text = bytes.text(size), before = document_of(env.get());
  if (check(mjenv_randomize(env.get(), text.c_str())) != MJENV_OK) {
    REQUIRE(document_of(env.get()) == before);
    return 0;
  }
  const std::string document = document_of(env.get());
  REQUIRE(mjenv_randomize(env.get(), document.c_str()) == MJENV_OK);
  REQUIRE(document_of(env.get()) == document);
  const std::vector<float> action(2 * static_cast<std::size_t>(mjenv_field_count(env.get(), MJENV_ROLE_ACTION)), 0.5F);
  check(mjenv_reset(env.get(), nullptr, nullptr));
  for (int step = 0; step < 3; ++step)
    check(mjenv_step(env.get(), nullptr, action.data(), action.size(), MJENV_DTYPE_FLOAT32, nullptr));
  REQUIRE(mjenv_randomize(env.get(), nullptr) == MJENV_OK);
  return 0;
}
