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
void fill_orthogonal(float* weights, const Layer& layer, double gain, Random& random) {
  const bool by_inputs = layer.inputs < layer.outputs;
  const int count = by_inputs ? layer.inputs : layer.outputs, length = by_inputs ? layer.outputs : layer.inputs;
  std::vector<std::vector<double>> basis;
  for (int i = 0; i < count; ++i) {
    std::vector<double> v(static_cast<std::size_t>(length));
    for (double& x : v) x = random.normal();
    make_orthogonal(v, basis);
    scale_to_unit(v);
    for (int j = 0; j < length; ++j)
      weights[by_inputs ? i * layer.padded_outputs + j : j * layer.padded_outputs + i] =
          static_cast<float>(gain * v[static_cast<std::size_t>(j)]);
    basis.push_back(std::move(v));
  }
}

}  // namespace

Network::Network(int inputs, const std::vector<int>& hidden, int outputs, mjenv_activation activation,
                 std::vector<std::uint8_t> seen)
    : activation_(activation), seen_(std::move(seen)) {
  int before = inputs, padded_before = padded(inputs, kInputBlock);
  const auto add = [&](int width) {
    const int stride = padded(width, kLaneBlock);
    const std::size_t weights = size_, bias = weights + static_cast<std::size_t>(padded_before) * stride;
    layers_.push_back({before, width, padded_before, stride, weights, bias});
    size_ = bias + stride;
    before = width;
    padded_before = stride;
  };
  for (const int width : hidden) add(width);
  add(outputs);
}

void Network::initialize(float* parameters, double gain, Random& random) const {
  std::fill(parameters, parameters + size_, 0.0F);
  for (const Layer& layer : layers_)
    fill_orthogonal(parameters + layer.weights, layer, &layer == &layers_.back() ? gain : std::sqrt(2.0), random);
  clear_unseen(parameters + layers_.front().weights);
}

void Network::clear_unseen(float* first_weights) const {
  const Layer& first = layers_.front();
  for (int i = 0; i < first.inputs; ++i)
    if (!sees(i)) std::fill_n(first_weights + i * first.padded_outputs, first.padded_outputs, 0.0F);
}

void Network::transpose(const float* parameters, std::vector<float>& transposed) const {
  std::size_t at = 0;
  for (std::size_t l = 1; l < layers_.size(); ++l) {
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
  int stride = network_.input_stride();
  for (std::size_t l = 0; l < outputs_.size(); ++l) {
    const Layer& layer = network_.layers_[l];
    float* y = outputs_[l].data();
    kernels.product(x, stride, rows, layer.padded_inputs, parameters + layer.weights, layer.padded_outputs,
                    parameters + layer.bias, y);
    stride = layer.padded_outputs;
    if (l + 1 < outputs_.size()) kernels.activate(network_.activation_, y, static_cast<std::size_t>(rows) * stride);
    x = y;
  }
  return x;
}

void Network::Pass::backward(const Kernels& kernels, const float* transposed, const float* x, int rows,
                             float* gradient) {
  const auto& layers = network_.layers_;
  std::size_t at = 0;  // where the layer's transposed weights begin
  for (std::size_t l = 1; l < layers.size(); ++l)
    at += static_cast<std::size_t>(layers[l].padded_inputs) * layers[l].padded_outputs;
  for (std::size_t l = layers.size() - 1; l > 0; --l) {
    const Layer& layer = layers[l];
    const float *before = outputs_[l - 1].data(), *output_gradient = output_gradients_[l].data();
    kernels.gradient(before, layer.padded_inputs, rows, layer.padded_inputs, output_gradient, layer.padded_outputs,
                     gradient + layer.weights, gradient + layer.bias);
    at -= static_cast<std::size_t>(layer.padded_inputs) * layer.padded_outputs;
    // Padding outputs are left out, because their gradients are 0.
    kernels.product(output_gradient, layer.padded_outputs, rows, layer.outputs, transposed + at, layer.padded_inputs,
                    nullptr, output_gradients_[l - 1].data());
    kernels.derive(network_.activation_, before, output_gradients_[l - 1].data(),
                   static_cast<std::size_t>(rows) * layer.padded_inputs);
  }
  const Layer& first = layers.front();
  kernels.gradient(x, first.padded_inputs, rows, first.padded_inputs, output_gradients_.front().data(),
                   first.padded_outputs, gradient + first.weights, gradient + first.bias);
  if (!network_.seen_.empty()) network_.clear_unseen(gradient + first.weights);
}

}  // namespace mjenv::learn
