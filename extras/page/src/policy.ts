/** A trained policy in the text format of examples/policies, which docs/training.md describes. */

type Activation = (x: number) => number;

interface Layer {
  activate: Activation;
  bias: Float64Array;
  weights: Float64Array[]; // one row for each output
}

const HEADS = ["mjenv-policy 1", "mjenv-policy 2"];
const ACTIVATIONS: Record<string, Activation | undefined> = {
  identity: (x) => x,
  relu: (x) => Math.max(x, 0),
  tanh: Math.tanh,
  elu: (x) => (x > 0 ? x : Math.expm1(x)),
};

const clamp = (x: number, low: number, high: number) => Math.min(Math.max(x, low), high);
const numbers = (words: string[]) => Float64Array.from(words, Number);

export class Policy {
  private constructor(
    readonly id: string,
    private readonly mean: Float64Array,
    private readonly scale: Float64Array,
    private readonly low: Float64Array,
    private readonly high: Float64Array,
    private readonly clip: number,
    private readonly layers: Layer[],
  ) {}

  get inputs(): number {
    return this.mean.length;
  }

  get outputs(): number {
    return this.low.length;
  }

  static parse(text: string): Policy {
    const [head, idLine, ...lines] = text.trim().split("\n");
    if (!HEADS.includes(head ?? "")) throw new Error(`a policy begins with "${HEADS[1]}"`);
    const lists: Record<string, Float64Array | undefined> = {};
    const layers: Layer[] = [];
    for (const line of lines) {
      const [name = "", ...words] = line.trim().split(/\s+/);
      const layer = layers.at(-1);
      if (name === "layer") {
        const activate = ACTIVATIONS[words[2] ?? ""];
        if (!activate) throw new Error(`a layer has the unknown activation ${words[2]}`);
        layers.push({ activate, bias: new Float64Array(), weights: [] });
      } else if (name === "bias" && layer) layer.bias = numbers(words);
      else if (name === "weights" && layer) layer.weights.push(numbers(words));
      else if (name !== "about" && name !== "input") lists[name] = numbers(words); // these tell of the environment
    }
    const { mean, scale, low, high, clip } = lists;
    if (!mean || !scale || !low || !high || clip?.[0] === undefined) throw new Error("a part of the policy is missing");
    let width = mean.length;
    for (const { bias, weights } of layers) {
      if (weights.length !== bias.length || weights.some((row) => row.length !== width))
        throw new Error("the layers of the policy do not fit each other");
      width = bias.length;
    }
    if (scale.length !== mean.length || low.length !== width || high.length !== width)
      throw new Error("the arrays of the policy do not fit each other");
    return new Policy(idLine?.replace(/^id /, "") ?? "", mean, scale, low, high, clip[0], layers);
  }

  /** Writes the deterministic action for an observation. */
  act(observation: Float64Array, action: Float32Array): void {
    let values = observation.map((x, i) => clamp((x - this.mean[i]) / this.scale[i], -this.clip, this.clip));
    for (const { activate, bias, weights } of this.layers) {
      values = bias.map((sum, output) => {
        const row = weights[output];
        for (let input = 0; input < row.length; input++) sum += row[input] * values[input];
        return activate(sum);
      });
    }
    values.forEach((x, i) => (action[i] = clamp(x, this.low[i], this.high[i])));
  }
}
