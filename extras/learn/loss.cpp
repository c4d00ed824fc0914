#include "loss.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <functional>

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

Loss::Scratch::Scratch(const Agent& agent)
    : passes{Network::Pass(agent.actor, kChunk), Network::Pass(agent.critic, kChunk)},
      inputs(kChunk * agent.stride()),
      ratios(kChunk) {}

Loss::Loss(const Agent& agent, const Kernels& kernels, core::Pool& pool)
    : agent_(agent),
      kernels_(kernels),
      pool_(pool),
      sides_{Side{agent.actor, 0, std::vector<float>(agent.actor.transposed_size())},
             Side{agent.critic, agent.critic_at, std::vector<float>(agent.critic.transposed_size())}},
      parts_(kMaxParts, Part{std::vector<float>(agent.size), {}}),
      deviations_(agent) {
  for (int i = 0; i < std::min(pool.threads(), 2 * kMaxParts); ++i) scratch_.emplace_back(agent);
}

LossTerms Loss::differentiate(const std::vector<float>& parameters, const Rollout& rollout, const Minibatch& batch,
                              const Settings& settings) {
  const int parts = std::min(kMaxParts, padded(batch.count, kChunk) / kChunk);
  deviations_.update(kernels_, parameters);
  const Task task{parameters.data(), rollout, batch, settings, parts};
  const auto job = [&](int worker) { share(task, worker); };
  pool_.run(std::cref(job));
  Part& all = parts_.front();
  // The derivative of a normal distribution's entropy with respect to the logarithm of its standard deviation is 1.
  for (std::size_t j = 0; j < agent_.actuators; ++j)
    all.gradient[agent_.log_std_at + j] -= static_cast<float>(settings.entropy_coef);
  LossTerms terms = all.terms[0];
  terms.add(all.terms[1]);
  return terms;
}

// Computes this thread's share of the gradient. Of two threads, each computes one side, because numbers that another
// thread has written take long to arrive from the cache of its CPU. More threads divide the parts of the sides as well.
// A single thread computes both sides of a part at once, because they have the same inputs.
void Loss::share(const Task& task, int worker) {
  const int parts = task.parts, threads = pool_.threads(), groups = std::min(threads, 2), jobs = groups * parts;
  const int busy = std::min(threads, jobs);  // so many threads have jobs
  const auto meet = [&] {
    if (threads > groups) pool_.meet();  // otherwise each thread needs only what it has computed itself
  };
  const int first = std::min(jobs, jobs * worker / busy), end = std::min(jobs, jobs * (worker + 1) / busy);
  const auto job_at = [&](int index) {
    const auto group = static_cast<std::size_t>(index / parts), size = sides_.size() / static_cast<std::size_t>(groups);
    return Job{index % parts, group * size, (group + 1) * size};
  };
  for (auto n = static_cast<std::size_t>(worker); n < sides_.size(); n += static_cast<std::size_t>(threads))
    sides_[n].network.transpose(task.parameters + sides_[n].at, sides_[n].transposed);
  meet();
  for (int i = first; i < end; ++i) {
    const Job job = job_at(i);
    Scratch& scratch = scratch_[static_cast<std::size_t>(worker)];
    // A thread that has computed all parts before this one adds it to their sum. So it uses the memory of only two parts,
    // which stays in the cache.
    const bool follows = job.part > 0 && i - first >= job.part;
    Part& part = parts_[static_cast<std::size_t>(follows ? 1 : job.part)];
    differentiate(task, job, part, scratch);
    if (follows) add(job, part);
  }
  meet();
  // The thread that has computed the first part of a group adds those that other threads have computed.
  for (int i = first; i < end; ++i)
    if (i % parts == 0)
      for (int other = std::max(end, i + 1); other < i + parts; ++other)
        add(job_at(other), parts_[static_cast<std::size_t>(other - i)]);
}

// Adds the gradient of a part to that of the first part.
void Loss::add(const Job& job, const Part& part) {
  Part& all = parts_.front();
  const auto add_slice = [&](std::size_t at, std::size_t size) {
    kernels_.add(&part.gradient[at], &all.gradient[at], size);
  };
  for (std::size_t n = job.first_side; n < job.end_side; ++n) {
    add_slice(sides_[n].at, sides_[n].network.size());
    all.terms[n].add(part.terms[n]);
  }
  if (job.first_side == 0) add_slice(agent_.log_std_at, agent_.size - agent_.log_std_at);
}

// Computes the gradient of one part of the minibatch. A part consists of consecutive whole chunks.
void Loss::differentiate(const Task& task, const Job& job, Part& part, Scratch& scratch) {
  const int count = task.batch.count, chunks = padded(count, kChunk) / kChunk;
  const int first = job.part * chunks / task.parts, end = (job.part + 1) * chunks / task.parts;
  for (std::size_t n = job.first_side; n < job.end_side; ++n) part.terms[n] = {};
  if (job.first_side == 0) std::fill_n(&part.gradient[agent_.log_std_at], agent_.actuators, 0.0F);
  for (int chunk = first; chunk < end; ++chunk)
    add_chunk(task, job, chunk * kChunk, std::min(kChunk, count - chunk * kChunk), chunk > first, part, scratch);
}

// Adds the gradient of a chunk to that of its part, or writes it there if it is the first chunk.
void Loss::add_chunk(const Task& task, const Job& job, int from, int count, bool adds, Part& part, Scratch& scratch) {
  const std::size_t stride = agent_.stride();
  const int rows = padded(count, kRowBlock);
  const std::int32_t* steps = task.batch.steps + from;
  for (int i = 0; i < count; ++i)
    std::memcpy(&scratch.inputs[static_cast<std::size_t>(i) * stride],
                &task.rollout.inputs[static_cast<std::size_t>(steps[i]) * stride], stride * sizeof(float));
  const float* x = scratch.inputs.data();
  for (std::size_t n = job.first_side; n < job.end_side; ++n) {
    const Side& side = sides_[n];
    Network::Pass& pass = scratch.passes[n];
    const float* output = pass.forward(kernels_, task.parameters + side.at, x, rows);
    std::fill_n(pass.output_gradient(), rows * side.network.output_stride(), 0.0F);
    if (n == 0)
      add_policy_gradient(task, steps, count, output, part, scratch);
    else
      add_value_gradient(task, steps, count, output, part, scratch);
    pass.backward(kernels_, task.parameters + side.at, side.transposed.data(), x, rows, adds, &part.gradient[side.at]);
  }
}

// The objective is min(ratio * advantage, bounded * advantage). ratio is the probability of the action under the
// present policy divided by that under the policy of the rollout; bounded is the clipped ratio.
void Loss::add_policy_gradient(const Task& task, const std::int32_t* steps, int count, const float* mean, Part& part,
                               Scratch& scratch) {
  LossTerms terms = part.terms[0];  // a copy, because another thread may write to the memory beside them
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
  std::fill(scratch.ratios.begin(), scratch.ratios.end(), 0.0F);
  for (int i = 0; i < count; ++i) {
    float log_ratio = constant - task.rollout.log_probabilities[static_cast<std::size_t>(steps[i])];
    for (std::size_t j = 0; j < actuators; ++j) {
      const float z = distance(i, j);
      log_ratio -= 0.5F * z * z;
    }
    scratch.ratios[static_cast<std::size_t>(i)] = log_ratio;
    terms.kl -= log_ratio;
  }
  kernels_.exp(scratch.ratios.data(), scratch.ratios.size());

  const auto clip = static_cast<float>(task.settings.clip), share = 1.0F / static_cast<float>(task.batch.count);
  float *output_gradient = scratch.passes[0].output_gradient(), *std_gradient = &part.gradient[agent_.log_std_at];
  for (int i = 0; i < count; ++i) {
    const float ratio = scratch.ratios[static_cast<std::size_t>(i)];
    const float advantage =
        (task.rollout.advantages[static_cast<std::size_t>(steps[i])] - task.batch.mean) * task.batch.inverse_std;
    const float bounded = std::min(1 + clip, std::max(1 - clip, ratio));
    terms.kl += ratio - 1;
    terms.clipped += bounded != ratio ? 1 : 0;
    terms.policy -= std::min(ratio * advantage, bounded * advantage);
    const bool follows = advantage >= 0 ? ratio <= 1 + clip : ratio >= 1 - clip;
    if (!follows) continue;  // the bounded term is smaller, and does not depend on the parameters
    const float slope = -advantage * ratio * share;
    for (std::size_t j = 0; j < actuators; ++j) {
      const float z = distance(i, j);
      output_gradient[static_cast<std::size_t>(i) * stride + j] = slope * z * inverse_std[j];
      std_gradient[j] += slope * (z * z - 1);
    }
  }
  part.terms[0] = terms;
}

// With value_clip, the error is the greater of two: that of the value, and that of the value whose change since the
// rollout is clipped.
void Loss::add_value_gradient(const Task& task, const std::int32_t* steps, int count, const float* value, Part& part,
                              Scratch& scratch) {
  LossTerms terms = part.terms[1];
  const auto stride = static_cast<std::size_t>(agent_.critic.output_stride());
  const auto factor = static_cast<float>(2 * task.settings.value_coef) / static_cast<float>(task.batch.count);
  const auto most = static_cast<float>(task.settings.value_clip);
  float* output_gradient = scratch.passes[1].output_gradient();
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
    terms.value += error * error;
    output_gradient[static_cast<std::size_t>(i) * stride] = slope * error;
  }
  part.terms[1] = terms;
}

}  // namespace mjenv::learn
