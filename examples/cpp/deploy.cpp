// Plays a policy that examples/python/train_*.py saved. It needs neither Python nor a learning library.
//
//     deploy POLICY [EPISODES [SEED]]        (3 episodes from seed 100)
//
// Prints a line for each episode: its length, its return as a hexadecimal float, and a checksum over the bits of all
// actions. examples/python/deploy.py prints the same, because both evaluate the policy in float64 and round each
// operation separately. So compile this without fused multiply-add (-ffp-contract=off). docs/training.md describes the
// file.
#include <mjenv/mjenv.hpp>

#include <algorithm>
#include <cinttypes>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <iostream>
#include <map>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

namespace {

using Numbers = std::vector<double>;

struct Layer {
  std::size_t inputs = 0;
  bool squashes = false;  // whether tanh follows
  Numbers bias;
  Numbers weights;  // [outputs][inputs]

  Numbers operator()(const Numbers& in) const {
    Numbers out = bias;
    for (std::size_t j = 0; j < out.size(); ++j) {
      for (std::size_t i = 0; i < inputs; ++i) out[j] += weights[j * inputs + i] * in[i];
      if (squashes) out[j] = std::tanh(out[j]);
    }
    return out;
  }
};

struct Policy {
  std::string id;
  std::map<std::string, Numbers> numbers;  // mean, scale, clip, low, high
  std::vector<Layer> layers;

  std::vector<float> act(const Numbers& observation) const {
    const Numbers &mean = numbers.at("mean"), &scale = numbers.at("scale");
    const double clip = numbers.at("clip").at(0);
    Numbers values(observation.size());
    for (std::size_t i = 0; i < values.size(); ++i)
      values[i] = std::clamp((observation[i] - mean[i]) / scale[i], -clip, clip);
    for (const auto& layer : layers) values = layer(values);
    std::vector<float> action(values.size());
    const Numbers &low = numbers.at("low"), &high = numbers.at("high");
    for (std::size_t i = 0; i < action.size(); ++i)
      action[i] = static_cast<float>(std::clamp(values[i], low[i], high[i]));
    return action;
  }
};

void require(bool holds, const std::string& what) {
  if (!holds) throw std::runtime_error(what);
}

Numbers read_numbers(std::istringstream& words) {
  Numbers numbers;
  for (std::string word; words >> word;) numbers.push_back(std::strtod(word.c_str(), nullptr));
  return numbers;
}

Policy load(const std::string& path) {
  std::ifstream file(path);
  std::string line;
  const bool has_head = std::getline(file, line) && (line == "mjenv-policy 1" || line == "mjenv-policy 2");
  require(has_head, path + ": no policy");
  Policy policy;
  while (std::getline(file, line)) {
    std::istringstream words(line);
    std::string name;
    words >> name;
    if (name == "id") {
      words >> policy.id;
    } else if (name == "layer") {
      Layer layer;
      std::size_t outputs;
      std::string activation;
      words >> outputs >> layer.inputs >> activation;
      require(activation == "tanh" || activation == "identity", "unknown activation " + activation);
      layer.squashes = activation == "tanh";
      policy.layers.push_back(layer);
    } else if (name == "bias" || name == "weights") {
      require(!policy.layers.empty(), name + " before a layer");
      const Numbers row = read_numbers(words);
      Layer& layer = policy.layers.back();
      require(name == "bias" || row.size() == layer.inputs, "a row of weights of another length than the inputs");
      Numbers& to = name == "bias" ? layer.bias : layer.weights;
      to.insert(to.end(), row.begin(), row.end());
    } else if (name != "about" && name != "input") {  // what version 2 tells of the environment
      policy.numbers[name] = read_numbers(words);
    }
  }
  return policy;
}

// Throws unless the sizes of the policy's arrays fit each other and the environment.
void check(const Policy& policy, std::size_t observations, std::size_t actions) {
  std::size_t width = observations;
  for (const auto& layer : policy.layers) {
    require(layer.inputs == width && layer.weights.size() == layer.bias.size() * width, "layers that do not fit");
    width = layer.bias.size();
  }
  require(width == actions, "the last layer must have as many outputs as an action has numbers");
  for (const auto& [name, size] : std::map<std::string, std::size_t>{
           {"mean", observations}, {"scale", observations}, {"clip", 1}, {"low", actions}, {"high", actions}}) {
    const auto found = policy.numbers.find(name);
    require(found != policy.numbers.end() && found->second.size() == size, name + " is missing or of another length");
  }
}

void play(const Policy& policy, int episodes, std::uint64_t seed) {
  mjenv::Env env(policy.id);
  mjenv::Batch batch = env.batch();
  check(policy, batch.obs_count, env.count(MJENV_ROLE_ACTION));
  env.seed(seed);
  for (int episode = 0; episode < episodes; ++episode) {
    env.reset(batch);
    long length = 0;
    double total = 0;
    std::uint64_t checksum = 0xCBF29CE484222325;
    do {
      const std::vector<float> action = policy.act(batch.obs);
      for (const float& number : action) {
        std::uint32_t word;
        std::memcpy(&word, &number, sizeof word);
        checksum = (checksum ^ word) * 0x100000001B3;
      }
      env.step(action, batch);
      total += batch.reward[0];
      ++length;
    } while (!batch.ended(0));
    std::printf("%ld %a %016" PRIx64 "\n", length, total, checksum);
  }
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 2 || argc > 4) {
    std::cerr << "deploy POLICY [EPISODES [SEED]]\n";
    return 2;
  }
  try {
    play(load(argv[1]), argc > 2 ? std::atoi(argv[2]) : 3, argc > 3 ? std::strtoull(argv[3], nullptr, 10) : 100);
  } catch (const std::exception& error) {
    std::cerr << "deploy: " << error.what() << "\n";
    return 1;
  }
  return 0;
}
