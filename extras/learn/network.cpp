#include "network.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace mjenv::learn {
namespace {

// Makes v orthogonal to all vectors of a basis by subtracting its components along them. Does so twice, because
// rounding errors remain after the first time.
void make_orthogonal(std::vector<double>& v, const std::vector<std::vector<double>>& basis) {
  for (int pass = 0; pass < 2; ++pass)
    for (const auto& unit : basis) {
      double along = 0;
      for (std::size_t i = 0; i < v.size(); ++i) along += v[i] * unit[i];
      for (std::size_t i = 0; i < v.size(); ++i) v[i] -= along * unit[i];
    }
}

void scale_to_unit(std::vector<double>& v) {
  double squares = 0;
  for (const double x : v) squares += x * x;
  const double length = std::sqrt(squares);
  for (double& x : v) x /= length;
}

// Sets the weights so that their rows, or their columns if there are fewer of them, are orthogonal vectors of length
// `gain`.
void fill_orthogonal(float* parameters, const Layer& layer, double gain, Random& random) {
  const bool by_inputs = layer.inputs < layer.outputs;
  const int count = by_inputs ? layer.inputs : layer.outputs, length = by_inputs ? layer.outputs : layer.inputs;
  std::vector<std::vector<double>> basis;
  for (int i = 0; i < count; ++i) {
    std::vector<double> v(static_cast<std::size_t>(length));
    for (double& x : v) x = random.normal();
    make_orthogonal(v, basis);
    scale_to_unit(v);
    for (int j = 0; j < length; ++j)
      parameters[by_inputs ? layer.weight(i, j) : layer.weight(j, i)] =
          static_cast<float>(gain * v[static_cast<std::size_t>(j)]);
    basis.push_back(std::move(v));
  }
}

}  // namespace

Network::Network(int inputs, const std::vector<int>& hidden, int outputs, Activation activation, std::vector<int> seen)
    : activation_(activation), seen_(std::move(seen)) {
  int before = inputs, padded_before = padded(inputs, hidden.empty() ? kLaneBlock : kInputBlock);
  const auto add = [&](int width, bool last) {
    const int stride = padded(width, kLaneBlock), stored = last ? padded(width, kInputBlock) : stride;
    const std::size_t weights = size_, bias = weights + static_cast<std::size_t>(padded_before) * stored;
    layers_.push_back({before, width, padded_before, stride, weights, bias, last});
    size_ = bias + stride;
    before = width;
    padded_before = stride;
  };
  for (const int width : hidden) add(width, false);
  add(outputs, true);
}

void Network::initialize(float* parameters, double gain, Random& random) const {
  std::fill(parameters, parameters + size_, 0.0F);
  for (const Layer& layer : layers_) fill_orthogonal(parameters, layer, layer.last ? gain : std::sqrt(2.0), random);
  clear_unseen(parameters);
}

// Sets the weights of inputs that have no effect, or their derivatives, to 0.
void Network::clear_unseen(float* parameters) const {
  const Layer& first = layers_.front();
  for (int i = 0; i < first.inputs; ++i)
    if (!sees(i))
      for (int o = 0; o < first.outputs; ++o) parameters[first.weight(i, o)] = 0;
}

void Network::mark_used(std::vector<bool>& is_used, std::size_t at) const {
  for (const Layer& layer : layers_)
    for (int o = 0; o < layer.outputs; ++o) {
      is_used[at + layer.bias + static_cast<std::size_t>(o)] = true;
      for (int i = 0; i < layer.inputs; ++i)
        if (&layer != &layers_.front() || sees(i)) is_used[at + layer.weight(i, o)] = true;
    }
}

std::size_t Network::transposed_size() const {
  std::size_t size = 0;
  for (std::size_t l = 1; l + 1 < layers_.size(); ++l)
    size += static_cast<std::size_t>(layers_[l].padded_inputs) * layers_[l].padded_outputs;
  return size;
}

void Network::transpose(const float* parameters, std::vector<float>& transposed) const {
  std::size_t at = 0;
  for (std::size_t l = 1; l + 1 < layers_.size(); ++l) {
    const Layer& layer = layers_[l];
    const float* from = parameters + layer.weights;
    for (int o = 0; o < layer.padded_outputs; ++o)
      for (int i = 0; i < layer.padded_inputs; ++i) transposed[at++] = from[i * layer.padded_outputs + o];
  }
}

Network::Pass::Pass(const Network& network, int rows) : network_(network) {
  for (const Layer& layer : network.layers_) {
    const auto count = static_cast<std::size_t>(padded(rows, kRowBlock)) * layer.padded_outputs;
    outputs_.emplace_back(count);
    output_gradients_.emplace_back(count);
  }
}

const float* Network::Pass::forward(const Kernels& kernels, const float* parameters, const float* x, int rows) {
  for (std::size_t l = 0; l < outputs_.size(); ++l) {
    const Layer& layer = network_.layers_[l];
    const float *weights = parameters + layer.weights, *bias = parameters + layer.bias;
    float* y = outputs_[l].data();
    if (layer.last) {
      kernels.dots(x, rows, layer.padded_inputs, weights, layer.outputs, bias, layer.padded_outputs, y);
    } else {
      kernels.product(x, layer.padded_inputs, rows, layer.padded_inputs, weights, layer.padded_outputs, bias, y);
      kernels.activate(network_.activation_, y, static_cast<std::size_t>(rows) * layer.padded_outputs);
    }
    x = y;
  }
  return x;
}

// Padding outputs are left out where their gradients, which are 0, would be multiplied by weights.
void Network::Pass::backward(const Kernels& kernels, const float* parameters, const float* transposed, const float* x,
                             int rows, bool adds, float* gradient) {
  const auto& layers = network_.layers_;
  const float* weights = parameters + layers.back().weights;  // of the present layer, [outputs][inputs]
  transposed += network_.transposed_size();
  for (std::size_t l = layers.size(); l-- > 0;) {
    const Layer& layer = layers[l];
    const int inputs = layer.padded_inputs, outputs = layer.padded_outputs;
    const float *before = l == 0 ? x : outputs_[l - 1].data(), *output_gradient = output_gradients_[l].data();
    float* to = gradient + layer.weights;
    if (layer.last)
      kernels.gradient(output_gradient, outputs, rows, padded(layer.outputs, kInputBlock), before, inputs, adds, to);
    else
      kernels.gradient(before, inputs, rows, inputs, output_gradient, outputs, adds, to);
    kernels.sum_rows(output_gradient, rows, outputs, adds, gradient + layer.bias);
    if (l == 0) break;
    if (!layer.last) weights = transposed -= static_cast<std::size_t>(inputs) * outputs;
    float* input_gradient = output_gradients_[l - 1].data();
    kernels.product(output_gradient, outputs, rows, layer.outputs, weights, inputs, nullptr, input_gradient);
    kernels.derive(network_.activation_, before, input_gradient, static_cast<std::size_t>(rows) * inputs);
  }
  if (!network_.seen_.empty()) network_.clear_unseen(gradient);
}

}  // namespace mjenv::learn
