// MuJoCo 2.2.2's sparse matrices (engine_util_sparse.c and engine_util_solve.c) for several rows at once. Only their
// sums are sparse: the numbers lie in dense arrays, beside lists of the columns that MuJoCo's matrices have. The matrix
// of one lane may lack an element that those of others have, and MuJoCo leaves it out of the sums. For the same bits,
// such a lane adds -0, which changes no number.
#pragma once

#include "engine/lanes/mujoco2/smooth.hpp"

namespace mjenv::core::lanes {
namespace {

constexpr unsigned kAllLanes = (1U << kWidth) - 1;

inline V negative_zero() { return splat(-0.0); }
inline Mask is_negative_zero(V x) { return reinterpret_cast<Mask>(x) == reinterpret_cast<Mask>(negative_zero()); }

// mju_dotSparse, with the elements of a sparse row at these columns
inline V dotSparse(const V* row, const V* vec, const int* columns, int n) {
  V res{};
  int i = 0;
  if (n >= 4) {
    V sums[4];
    for (int k = 0; k < 4; ++k) sums[k] = row[columns[k]] * vec[columns[k]];
    for (i = 4; i <= n - 4; i += 4)
      for (int k = 0; k < 4; ++k) sums[k] += row[columns[i + k]] * vec[columns[i + k]];
    res = (sums[0] + sums[2]) + (sums[1] + sums[3]);
  }
  for (; i < n; ++i) res += row[columns[i]] * vec[columns[i]];
  return res;
}

// The sum that mju_dotSparse computes, where lanes lack some of the blocks of four products. lanes: for each product,
// the lanes, as bits, that have it. n is a multiple of 4.
inline V sum_of_blocks(const V* products, const unsigned char* lanes, int n) {
  V sums[4];
  for (V& sum : sums) sum = negative_zero();
  Mask has_any{};
  for (int i = 0; i < n; i += 4) {
    const Mask is_there = mask_of(lanes[i]);
    has_any |= is_there;
    for (int k = 0; k < 4; ++k) sums[k] += is_there ? products[i + k] : negative_zero();
  }
  return has_any ? (sums[0] + sums[2]) + (sums[1] + sums[3]) : V{};
}

// The sum that mju_dotSparse computes, where a lane may lack some of the products, so that its other products belong to
// other partial sums. lanes: for each product, the lanes, as bits, that have it.
V sum_of_each(const V* products, const unsigned char* lanes, int n) {
  bool has_blocks = n % 4 == 0;  // the same lanes have all four products of a block, as with most contacts
  for (int i = 0; i < n && has_blocks; ++i) has_blocks = lanes[i] == lanes[i & ~3];
  if (has_blocks) return sum_of_blocks(products, lanes, n);
  V res{};
  const auto* const numbers = reinterpret_cast<const double*>(products);
  for (int lane = 0; lane < kWidth; ++lane) {
    double own[4]{};
    double sums[4] = {-0.0, -0.0, -0.0, -0.0};
    int count = 0;
    for (int i = 0; i < n; ++i) {
      if (!(lanes[i] >> lane & 1)) continue;
      own[count % 4] = numbers[i * kWidth + lane];
      if (++count % 4 == 0)
        for (int k = 0; k < 4; ++k) sums[k] += own[k];
    }
    double sum = count < 4 ? 0 : (sums[0] + sums[2]) + (sums[1] + sums[3]);
    for (int k = 0; k < count % 4; ++k) sum += own[k];
    res[lane] = sum;
  }
  return res;
}

// The Cholesky factor of Newton's Hessian, and its elements
class SparseFactor {
 public:
  SparseFactor(const Constraints& c, int nv, double* numbers)
      : c_(c), pattern_(c.pattern), nv_(nv), numbers_(vectors(numbers)), products_(vectors(c.products)) {}

  // Finds the elements of the Hessian and of its factor: those of M and of J' * J, and those that the factorisation
  // adds.
  void find_pattern() {
    for (int r = 0; r < nv_; ++r)
      if (pattern_.is_changed[r]) reset(r);
    for (int i = 0; i < c_.size; ++i)
      if (c_.couples[i]) couple(c_.columns + i * nv_, c_.column_counts[i], c_.holders[i]);
    for (int r = nv_ - 1; r >= 0; --r) {
      if (!pattern_.is_changed[r]) continue;
      list(r);
      const int *const columns = columns_of(r), count = pattern_.counts[r];
      const unsigned char* const row = pattern_.filled + r * nv_;
      for (int i = 0; i < count; ++i)
        for (int j = 0; j < i; ++j) fill(columns[i], columns[j], row[columns[i]] & row[columns[j]]);
    }
  }

  // Sets all elements to +0.
  void clear() {
    for (int r = 0; r < nv_; ++r) {
      for (int i = 0; i < pattern_.counts[r]; ++i) numbers_[r * nv_ + columns_of(r)[i]] = V{};
      numbers_[r * (nv_ + 1)] = V{};
    }
  }

  // mj_addM
  void addM(const mjModel& m, const V* qM) {
    for (int r = 0; r < nv_; ++r) {
      V* const row = numbers_ + r * nv_;
      int adr = m.dof_Madr[r];
      for (int c = r; c >= 0; c = m.dof_simplenum[r] ? -1 : m.dof_parentid[c]) {
        const V number = qM[adr++], sum = row[c] + number;
        const Mask is_negative = is_negative_zero(number);
        // Where J' * J has no element, MuJoCo keeps a -0 of M. Here it would be added to +0, which gives +0.
        row[c] = __builtin_expect(any(is_negative), 0) && any(sum == V{})
                     ? (is_negative & ~mask_of(elements_of_J(r, c)) ? number : sum)
                     : sum;
      }
      for (int i = 0; i < pattern_.counts[r] && pattern_.is_changed[r]; ++i) {
        const int c = columns_of(r)[i], element = r * nv_ + c;
        if (!pattern_.of_M[element]) row[c] = mask_of(pattern_.of_J[element]) ? row[c] : negative_zero();
      }
    }
  }

  // mju_cholFactorSparse. Returns the lanes, as bits, in which the matrix does not have full rank.
  unsigned factor() {
    unsigned lost = 0;
    for (int r = nv_ - 1; r >= 0; --r) {
      V *const row = numbers_ + r * nv_, *const values = products_;
      const int *const columns = columns_of(r), count = pattern_.counts[r];
      const Mask is_small = row[r] < splat(mjMINVAL);
      lost |= bits(is_small);
      row[r] = sqrt(is_small ? splat(mjMINVAL) : row[r]);
      const V inverse = 1.0 / row[r];
      for (int i = 0; i < count; ++i) values[i] = row[columns[i]] = row[columns[i]] * inverse;
      if (pattern_.is_mixed[r])
        subtract_mixed(values, columns, count, pattern_.filled + r * nv_);
      else
        subtract(values, columns, count);
    }
    return lost;
  }

  // mju_cholSolveSparse
  void solve(V* res, const V* vec) const {
    copy(res, vec, nv_);
    for (int r = nv_ - 1; r >= 0; --r) {
      const Mask is_zero = res[r] == V{};
      if (!any(~is_zero)) continue;
      const V* const row = numbers_ + r * nv_;
      const int* const columns = columns_of(r);
      const V x = res[r] = res[r] / row[r];
      const bool is_simple = !pattern_.is_mixed[r] && !any(is_zero);
      for (int i = 0; i < pattern_.counts[r]; ++i) {
        const V product = row[columns[i]] * x;
        res[columns[i]] -=
            is_simple ? product : (mask_of(pattern_.filled[r * nv_ + columns[i]]) & ~is_zero ? product : V{});
      }
    }
    for (int r = 0; r < nv_; ++r) {
      const V* const row = numbers_ + r * nv_;
      const int *const columns = columns_of(r), count = pattern_.counts[r];
      if (pattern_.is_mixed[r]) {
        for (int i = 0; i < count; ++i) {
          products_[i] = row[columns[i]] * res[columns[i]];
          c_.product_lanes[i] = pattern_.filled[r * nv_ + columns[i]];
        }
        res[r] -= sum_of_each(products_, c_.product_lanes, count);
      } else if (count > 0) {
        res[r] -= dotSparse(row, res, columns, count);
      }
      res[r] = res[r] / row[r];
    }
  }

  // Empties the vector of a rank-one update. add_element then adds its elements.
  void begin_vector(V* x) {
    for (int k = 0; k < nv_; ++k) {
      x[k] = negative_zero();
      pattern_.of_vector[k] = 0;
    }
  }
  void add_element(int k, unsigned lanes) { pattern_.of_vector[k] |= static_cast<unsigned char>(lanes); }

  // mju_cholUpdateSparse. Returns the lanes, as bits, in which the matrix loses rank.
  unsigned update(V* x, Mask plus) {
    unsigned lost = 0;
    unsigned char* const has = pattern_.of_vector;
    for (int r = nv_ - 1; r >= 0; --r) {
      const unsigned used = has[r];
      if (used == 0) continue;
      V* const row = numbers_ + r * nv_;
      const int* const columns = columns_of(r);
      const V vec = x[r], diagonal = row[r];
      V square = diagonal * diagonal + (plus ? vec * vec : -vec * vec);
      const Mask is_small = square < splat(mjMINVAL);
      lost |= bits(is_small) & used;
      square = is_small ? splat(mjMINVAL) : square;
      const V root = sqrt(square), c = root / diagonal, s = vec / diagonal, negative_s = -s;
      const V inverse = 1.0 / c, scale = plus ? s / c : -s / c;
      const Mask is_used = mask_of(used);
      row[r] = is_used ? root : diagonal;
      for (int i = 0; i < pattern_.counts[r]; ++i) {
        const int k = columns[i];
        const unsigned both = pattern_.is_mixed[r] ? used & pattern_.filled[r * nv_ + k] : used;
        V term = x[k] * scale;
        if ((both & ~has[k]) != 0) {
          term = mask_of(has[k]) ? term : negative_zero();
          has[k] |= static_cast<unsigned char>(both);
        }
        const V next = row[k] * inverse + term, other = x[k] * c + next * negative_s;
        const Mask is_changed = both == used ? is_used : mask_of(both);
        row[k] = is_changed ? next : row[k];
        x[k] = is_changed ? other : x[k];
      }
    }
    return lost;
  }

 private:
  // Subtracts from the rows above the contribution of a row of the factor, given its values and their columns. Two rows
  // at a time are faster.
  void subtract(const V* values, const int* columns, int count) const {
    int i = 0;
    for (; i + 1 < count; i += 2) {
      V *const res0 = numbers_ + columns[i] * nv_, *const res1 = numbers_ + columns[i + 1] * nv_;
      const V scale0 = -values[i], scale1 = -values[i + 1];
      for (int j = 0; j <= i; ++j) {
        const int column = columns[j];
        const V value = values[j], sum0 = res0[column] + scale0 * value, sum1 = res1[column] + scale1 * value;
        res0[column] = sum0;
        res1[column] = sum1;
      }
      res1[columns[i + 1]] += scale1 * values[i + 1];
    }
    if (i == count) return;
    V* const res = numbers_ + columns[i] * nv_;
    for (int j = 0; j <= i; ++j) res[columns[j]] -= values[i] * values[j];
  }

  // The same for a row in which lanes have different elements. lanes: for each column, the lanes, as bits, that have
  // it.
  void subtract_mixed(const V* values, const int* columns, int count, const unsigned char* lanes) const {
    Mask* const masks = reinterpret_cast<Mask*>(products_ + nv_);
    for (int i = 0; i < count; ++i) {
      V* const res = numbers_ + columns[i] * nv_;
      const Mask mask = masks[i] = mask_of(lanes[columns[i]]);
      for (int j = 0; j <= i; ++j) res[columns[j]] += mask & masks[j] ? -values[i] * values[j] : negative_zero();
    }
  }

  const Constraints& c_;
  const Pattern& pattern_;
  const int nv_;
  V *const numbers_, *const products_;

  int* columns_of(int r) const { return pattern_.columns + r * nv_; }

  // Gives row r the elements of M.
  void reset(int r) {
    for (int c = 0; c <= r; ++c) {
      pattern_.filled[r * nv_ + c] = pattern_.of_M[r * nv_ + c];
      pattern_.of_J[r * nv_ + c] = 0;
    }
    list(r);
    pattern_.is_changed[r] = 0;
  }

  // Lists the columns of row r.
  void list(int r) {
    int count = 0;
    bool is_mixed = false;
    for (int c = 0; c < r; ++c) {
      const unsigned lanes = pattern_.filled[r * nv_ + c];
      if (lanes == 0) continue;
      columns_of(r)[count++] = c;
      is_mixed |= (lanes & kAllLanes) != kAllLanes;
    }
    pattern_.counts[r] = count;
    pattern_.is_mixed[r] = is_mixed;
  }

  void fill(int r, int c, unsigned lanes) {
    unsigned char& element = pattern_.filled[r * nv_ + c];
    if ((lanes & ~element) == 0) return;
    element |= static_cast<unsigned char>(lanes);
    pattern_.is_changed[r] = 1;
  }

  // Adds the elements of a constraint.
  void couple(const int* columns, int count, unsigned lanes) {
    for (int i = 0; i < count; ++i)
      for (int j = 0; j < i; ++j) {
        const int element = columns[i] * nv_ + columns[j];
        if (pattern_.of_M[element]) continue;
        pattern_.of_J[element] |= static_cast<unsigned char>(lanes);
        fill(columns[i], columns[j], lanes);
      }
  }

  // The lanes, as bits, in which J' * J has this element.
  unsigned elements_of_J(int r, int c) const {
    unsigned lanes = 0;
    for (int i = 0; i < c_.dof_place_counts[r]; ++i) {
      const int place = c_.dof_places[r * c_.most_places + i];
      for (int n = 0; n < c_.column_counts[place]; ++n)
        if (c_.columns[place * nv_ + n] == c) lanes |= c_.holders[place];
    }
    return lanes;
  }
};

}  // namespace
}  // namespace mjenv::core::lanes
