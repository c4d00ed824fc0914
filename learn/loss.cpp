#include "loss.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>

namespace mjenv::learn {
namespace {

constexpr int kChunk = 64;    // steps that are evaluated together: their activations stay in the cache
constexpr int kMaxParts = 8;  // the most parts into which a minibatch is divided

}  // namespace

Minibatch::Minibatch(const std::int32_t* first, int number, const Rollout& rollout, bool normalize)
    : steps(first), count(number) {
  if (!normalize || count < 2) return;
  double sum = 0, squares = 0;
  for (int i = 0; i < count; ++i) sum += rollout.advantages[static_cast<std::size_t>(steps[i])];
  const double average = sum / count;
  for (int i = 0; i < count; ++i) {
    const double distance = rollout.advantages[static_cast<std::size_t>(steps[i])] - average;
    squares += distance * distance;
  }
  mean = static_cast<float>(average);
  inverse_std = static_cast<float>(1 / (std::sqrt(squares / (count - 1)) + 1e-8));
}

void LossTerms::add(const LossTerms& other) {
  policy += other.policy;
  value += other.value;
  kl += other.kl;
  clipped += other.clipped;
}

Loss::Part::Part(const Agent& agent)
    : actor(agent.actor, kChunk),
      critic(agent.critic, kChunk),
      inputs(kChunk * agent.stride()),
      ratios(kChunk),
      gradient(agent.size) {}

Loss::Loss(const Agent& agent, const Kernels& kernels, core::Pool& pool)
    : agent_(agent),
      kernels_(kernels),
      pool_(pool),
      actor_transposed_(agent.actor.transposed_size()),
      critic_transposed_(agent.critic.transposed_size()),
      deviations_(agent) {
  for (int i = 0; i < kMaxParts; ++i) parts_.push_back(std::make_unique<Part>(agent));
}

LossTerms Loss::differentiate(const std::vector<float>& parameters, const Rollout& rollout, const Minibatch& batch,
                              const mjenv_learn_settings& settings) {
  const int parts = std::min(kMaxParts, padded(batch.count, kChunk) / kChunk), threads = pool_.threads();
  agent_.actor.transpose(parameters.data(), actor_transposed_);
  agent_.critic.transpose(&parameters[agent_.critic_at], critic_transposed_);
  deviations_.update(kernels_, parameters);
  const Task task{parameters.data(), rollout, batch, settings};
  Part& first = *parts_[0];
  const auto add = [&](const Part& part) {
    kernels_.add(part.gradient.data(), first.gradient.data(), first.gradient.size());
    first.terms.add(part.terms);
  };
  if (threads == 1) {  // the memory of two parts stays in the cache
    differentiate_part(task, 0, parts, first);
    for (int i = 1; i < parts; ++i) {
      differentiate_part(task, i, parts, *parts_[1]);
      add(*parts_[1]);
    }
  } else {
    pool_.run([&](int worker) {
      for (int i = worker; i < parts; i += threads)
        differentiate_part(task, i, parts, *parts_[static_cast<std::size_t>(i)]);
    });
    for (int i = 1; i < parts; ++i) add(*parts_[static_cast<std::size_t>(i)]);
  }
  // The derivative of a normal distribution's entropy with respect to the logarithm of its standard deviation is 1.
  for (std::size_t j = 0; j < agent_.actuators; ++j)
    first.gradient[agent_.log_std_at + j] -= static_cast<float>(settings.entropy_coef);
  return first.terms;
}

// Computes the gradient of one part of the minibatch. A part consists of consecutive whole chunks.
void Loss::differentiate_part(const Task& task, int index, int parts, Part& part) {
  const int count = task.batch.count, chunks = padded(count, kChunk) / kChunk;
  const int first = index * chunks / parts, end = (index + 1) * chunks / parts;
  part.terms = {};
  std::fill_n(&part.gradient[agent_.log_std_at], agent_.actuators, 0.0F);
  for (int chunk = first; chunk < end; ++chunk)
    add_chunk(task, chunk * kChunk, std::min(kChunk, count - chunk * kChunk), chunk > first, part);
}

// Adds the gradient of a chunk to that of its part, or writes it there if it is the first chunk.
void Loss::add_chunk(const Task& task, int from, int count, bool adds, Part& part) {
  const std::size_t stride = agent_.stride();
  const int rows = padded(count, kRowBlock);
  const std::int32_t* steps = task.batch.steps + from;
  for (int i = 0; i < count; ++i)
    std::memcpy(&part.inputs[static_cast<std::size_t>(i) * stride],
                &task.rollout.inputs[static_cast<std::size_t>(steps[i]) * stride], stride * sizeof(float));
  const float *x = part.inputs.data(), *critic = task.parameters + agent_.critic_at;
  const float* mean = part.actor.forward(kernels_, task.parameters, x, rows);
  const float* value = part.critic.forward(kernels_, critic, x, rows);
  std::fill_n(part.actor.output_gradient(), rows * agent_.actor.output_stride(), 0.0F);
  std::fill_n(part.critic.output_gradient(), rows * agent_.critic.output_stride(), 0.0F);
  add_policy_gradient(task, steps, count, mean, part);
  add_value_gradient(task, steps, count, value, part);
  part.actor.backward(kernels_, task.parameters, actor_transposed_.data(), x, rows, adds, part.gradient.data());
  part.critic.backward(kernels_, critic, critic_transposed_.data(), x, rows, adds, &part.gradient[agent_.critic_at]);
}

// The objective is min(ratio * advantage, bounded * advantage). ratio is the probability of the action under the
// present policy divided by that under the policy of the rollout; bounded is the clipped ratio.
void Loss::add_policy_gradient(const Task& task, const std::int32_t* steps, int count, const float* mean, Part& part) {
  const std::size_t actuators = agent_.actuators;
  const auto stride = static_cast<std::size_t>(agent_.actor.output_stride());
  const float *log_std = task.parameters + agent_.log_std_at, *inverse_std = deviations_.inverse.data();
  float constant = 0;
  for (std::size_t j = 0; j < actuators; ++j) constant -= log_std[j] + static_cast<float>(kHalfLogTwoPi);
  // How many standard deviations action j of step i is away from its mean.
  const auto distance = [&](int i, std::size_t j) {
    const float action = task.rollout.actions[static_cast<std::size_t>(steps[i]) * actuators + j];
    return (action - mean[static_cast<std::size_t>(i) * stride + j]) * inverse_std[j];
  };
  std::fill(part.ratios.begin(), part.ratios.end(), 0.0F);
  for (int i = 0; i < count; ++i) {
    float log_ratio = constant - task.rollout.log_probabilities[static_cast<std::size_t>(steps[i])];
    for (std::size_t j = 0; j < actuators; ++j) {
      const float z = distance(i, j);
      log_ratio -= 0.5F * z * z;
    }
    part.ratios[static_cast<std::size_t>(i)] = log_ratio;
    part.terms.kl -= log_ratio;
  }
  kernels_.exp(part.ratios.data(), part.ratios.size());

  const auto clip = static_cast<float>(task.settings.clip), share = 1.0F / static_cast<float>(task.batch.count);
  float *output_gradient = part.actor.output_gradient(), *std_gradient = &part.gradient[agent_.log_std_at];
  for (int i = 0; i < count; ++i) {
    const float ratio = part.ratios[static_cast<std::size_t>(i)];
    const float advantage =
        (task.rollout.advantages[static_cast<std::size_t>(steps[i])] - task.batch.mean) * task.batch.inverse_std;
    const float bounded = std::min(1 + clip, std::max(1 - clip, ratio));
    part.terms.kl += ratio - 1;
    part.terms.clipped += bounded != ratio ? 1 : 0;
    part.terms.policy -= std::min(ratio * advantage, bounded * advantage);
    const bool follows = advantage >= 0 ? ratio <= 1 + clip : ratio >= 1 - clip;
    if (!follows) continue;  // the bounded term is smaller, and does not depend on the parameters
    const float slope = -advantage * ratio * share;
    for (std::size_t j = 0; j < actuators; ++j) {
      const float z = distance(i, j);
      output_gradient[static_cast<std::size_t>(i) * stride + j] = slope * z * inverse_std[j];
      std_gradient[j] += slope * (z * z - 1);
    }
  }
}

// With value_clip, the error is the greater of two: that of the value, and that of the value whose change since the
// rollout is clipped.
void Loss::add_value_gradient(const Task& task, const std::int32_t* steps, int count, const float* value, Part& part) {
  const auto stride = static_cast<std::size_t>(agent_.critic.output_stride());
  const auto factor = static_cast<float>(2 * task.settings.value_coef) / static_cast<float>(task.batch.count);
  const auto most = static_cast<float>(task.settings.value_clip);
  float* output_gradient = part.critic.output_gradient();
  for (int i = 0; i < count; ++i) {
    const auto step = static_cast<std::size_t>(steps[i]);
    const float now = value[static_cast<std::size_t>(i) * stride];
    float error = now - task.rollout.returns[step], slope = factor;
    if (most > 0) {
      const float change = now - task.rollout.values[step], bounded = std::min(most, std::max(-most, change));
      const float clipped = task.rollout.values[step] + bounded - task.rollout.returns[step];
      if (bounded != change && clipped * clipped > error * error) {
        error = clipped;
        slope = 0;
      }
    }
    part.terms.value += error * error;
    output_gradient[static_cast<std::size_t>(i) * stride] = slope * error;
  }
}

}  // namespace mjenv::learn
