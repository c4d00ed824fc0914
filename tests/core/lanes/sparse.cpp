// Sparse Jacobians, and the functions of sparse matrices.
#include "lanes/harness.hpp"

#include <algorithm>
#include <cmath>

// Functions of MuJoCo that mujoco.h does not list
extern "C" {
void mju_transposeSparse(mjtNum* res, const mjtNum* mat, int nr, int nc, int* res_rownnz, int* res_rowadr,
                         int* res_colind, const int* rownnz, const int* rowadr, const int* colind);
void mju_superSparse(int nr, int* rowsuper, const int* rownnz, const int* rowadr, const int* colind);
void mju_sqrMatTDSparse(mjtNum* res, const mjtNum* mat, const mjtNum* matT, const mjtNum* diag, int nr, int nc,
                        int* res_rownnz, int* res_rowadr, int* res_colind, const int* rownnz, const int* rowadr,
                        const int* colind, const int* rowsuper, const int* rownnzT, const int* rowadrT,
                        const int* colindT, const int* rowsuperT, mjData* d);
mjtNum mju_dotSparse(const mjtNum* vec1, const mjtNum* vec2, const int nnz1, const int* ind1);
int mju_cholFactorSparse(mjtNum* mat, int n, mjtNum mindiag, int* rownnz, int* rowadr, int* colind, mjData* d);
void mju_cholSolveSparse(mjtNum* res, const mjtNum* mat, const mjtNum* vec, int n, const int* rownnz, const int* rowadr,
                         const int* colind);
int mju_cholUpdateSparse(mjtNum* mat, mjtNum* x, int n, int flg_plus, int* rownnz, int* rowadr, int* colind, int x_nnz,
                         int* x_ind, mjData* d);
}

#define MJENV_LANES_WIDTH 2
#include "engine/lanes/frame/version_code.hpp"

namespace mjenv::core::lanes_tests {
namespace {

// Sparse Jacobians, with and without equality constraints, by each solver that lanes have for them. In the pairs of contacts.xml,
// each shape and kind of friction touches the world.
TEST(test_sparse) {
  const std::string text = odd_model("sparse.xml"),
                    contacts = with("<option", "<option jacobian=\"sparse\"", odd_model("contacts.xml"));
  const std::string free = with("<option", "<option><flag equality=\"disable\"/></option><option", text);
  // MuJoCo makes no constraint of a contact that no dof moves.
  const std::string unmoved = with("</worldbody>",
                                   "<geom name='sunk' size='0.1' pos='2 2 0'/></worldbody>"
                                   "<contact><pair geom1='floor' geom2='sunk'/></contact>",
                                   text);
  // A joint that depends on the first joint, and a joint that is held alone
  const std::string coupled = R"(<mujoco><option jacobian='sparse'/><worldbody><geom type='plane' size='5 5 1'/>
    <body pos='0 0 0.1'><joint name='first' axis='0 1 0'/><geom size='0.1' pos='0.2 0 0'/>
    <body pos='0.2 0 0'><joint name='second' axis='1 0 0'/><geom size='0.1' pos='0.1 0.1 0'/></body></body>
    <body pos='2 0 0.1'><joint name='third' axis='0 1 0'/><geom size='0.1' pos='0.2 0 0'/></body></worldbody>
    <equality><joint joint1='second' joint2='first' polycoef='0.1 0.5 0.1 0 0'/>
    <joint joint1='third'/></equality></mujoco>)";
  const struct {
    const char* name;
    const std::string& text;
    std::vector<const char*> options;
    bool are_made = true;
  } cases[] = {{"sparse.xml",
                text,
                {"", "<option solver='CG'/>", "<option cone='elliptic'/>", "<option solver='CG' cone='elliptic'/>"}},
               {"sparse.xml without equality",
                free,
                {"", "<option cone='elliptic' impratio='10'/>", "<option integrator='RK4' iterations='3'/>",
                 "<option><flag warmstart='disable' frictionloss='disable' limit='disable'/></option>"}},
               {"contacts.xml", contacts, {"", "<option solver='CG'/>", "<option cone='elliptic'/>"}},
               {"coupled joints", coupled, {"", "<option solver='CG'/>"}},
               {"sparse.xml with a contact of the world", unmoved, {""}, false}};
  failures.clear();
  for (const auto& c : cases)
    for (const char* option : c.options) {
      const auto model = Model::parse(c.name, in_front_of_body(option, c.text));
      assert_true(mj_isSparse(model->get()));
      const std::string found = compare(model, kFewRows), which = std::string(c.name) + ", " + option + ": ";
      if (!found.empty()) failures += which + found + "\n";
      if ((made_of_contacts > 0) != c.are_made)
        failures += which + "made in lanes " + std::to_string(made_of_contacts) + " times\n";
    }
  if (!failures.empty()) fail_msg("%s", failures.c_str());
}

// Random sparse matrices as Newton's solver has them, in lanes with different constraints, against MuJoCo's functions: J' * D *
// J + M, its Cholesky factor, solutions, and rank-one updates by a constraint. Many numbers are zeros of both signs.
class SparseMatrices {
 public:
  int lost = 0, mixed = 0;  // how many matrices lost rank, and how many rows differed between lanes

  void compare() {
    make_constraints();
    find_sums();
    lanes::SparseFactor factor(c_, n_, H_);
    factor.find_pattern();
    factor.clear();
    for (int r = 0; r < n_; ++r)
      for (int c = 0; c <= r; ++c)
        if (is_listed(r, c))
          for (int lane = 0; lane < kWidth; ++lane) at(H_, r * n_ + c, lane) = sums_[lane][r * n_ + c];
    factor.addM(m_, lanes::vectors(qM_));
    assert_same();
    const unsigned ranks = factor.factor();
    for (int lane = 0; lane < kWidth; ++lane) {
      Matrix& want = want_[lane];
      const int rank = mju_cholFactorSparse(want.numbers, n_, mjMINVAL, want.nnz, want.adr, want.columns, d_);
      assert_int_equal(ranks >> lane & 1, rank < n_);
    }
    for (int r = 0; r < n_; ++r) mixed += is_mixed_[r];
    // Without full rank, numbers may overflow, and the sign of NaN is undefined.
    if (ranks != 0) return;
    assert_same();
    for (int round = 0; round < 3; ++round) {
      solve(factor);
      if (!update(factor)) return;
      assert_same();
    }
  }

 private:
  static constexpr int kWidth = lanes::kWidth, n_ = 13, kMost = 9;
  struct Matrix {
    mjtNum numbers[n_ * n_];
    int nnz[n_], adr[n_], columns[n_ * n_];
  };
  const std::shared_ptr<const Model> model_ = Model::parse("tree", R"(<mujoco><worldbody>
    <body><joint/><geom size='.1'/><body><joint axis='0 1 0'/><joint axis='1 0 0'/><geom size='.1'/>
      <body><joint/><geom size='.1'/><body><joint/><geom size='.1'/></body></body>
      <body><joint type='ball'/><geom size='.1'/><body><joint/><geom size='.1'/></body></body></body></body>
    <body><joint axis='0 1 0'/><geom size='.1'/></body>
    <body><joint type='slide' axis='1 0 0'/><joint type='slide' axis='0 1 0'/><joint type='slide'/><geom size='.1'/></body>
    </worldbody></mujoco>)");
  Work work_{model_};
  const mjModel& m_ = *model_->get();
  mjData* const d_ = work_.data();
  Noise noise_;
  lanes::Constraints c_{};
  alignas(lanes::V) double J_[kMost * n_ * kWidth]{}, H_[n_ * n_ * kWidth]{}, qM_[n_ * n_ * kWidth]{},
      x_[n_ * kWidth]{}, products_[2 * n_ * kWidth]{}, solution_[n_ * kWidth]{};
  unsigned char of_M_[n_ * n_]{}, of_J_[n_ * n_]{}, filled_[n_ * n_]{}, is_changed_[n_]{}, is_mixed_[n_]{},
      vector_[n_]{}, holders_[kMost]{}, couples_[kMost]{}, product_lanes_[n_]{};
  int columns_[n_ * n_]{}, counts_[n_]{}, chains_[kMost * n_]{}, chain_counts_[kMost]{}, places_[n_ * kMost]{},
      place_counts_[n_]{};
  double D_[kMost]{}, sums_[kWidth][n_ * n_]{};
  Matrix want_[kWidth]{};

  static double& at(double* numbers, int i, int lane) { return numbers[i * kWidth + lane]; }
  double number() { return noise_.below(3) ? noise_() : noise_.odd() * 0; }
  bool is_listed(int r, int c) const {
    return r == c || std::count(columns_ + r * n_, columns_ + r * n_ + counts_[r], c) > 0;
  }

 public:
  SparseMatrices() {
    assert_int_equal(m_.nv, n_);
    assert_true(m_.dof_simplenum[n_ - 1] > 0);
    for (int i = 0; i < n_; ++i)
      for (int j = i; j >= 0; j = m_.dof_simplenum[i] ? -1 : m_.dof_parentid[j]) of_M_[i * n_ + j] = 255;
    std::fill_n(is_changed_, n_, 1);
    c_.J = J_;
    c_.columns = chains_;
    c_.column_counts = chain_counts_;
    c_.holders = holders_;
    c_.couples = couples_;
    c_.product_lanes = product_lanes_;
    c_.products = products_;
    c_.most_places = kMost;
    c_.dof_places = places_;
    c_.dof_place_counts = place_counts_;
    c_.pattern = {of_M_, of_J_, filled_, columns_, counts_, is_changed_, is_mixed_, vector_};
  }

 private:
  // Constraints between two dofs and what moves them; a few in each lane.
  void make_constraints() {
    c_.size = static_cast<int>(noise_.below(kMost + 1));
    std::fill_n(place_counts_, n_, 0);
    for (int i = 0; i < c_.size; ++i) {
      holders_[i] = static_cast<unsigned char>(1 + noise_.below((1U << kWidth) - 1));
      couples_[i] = 1;
      D_[i] = noise_.below(3) ? 1 + noise_() : 0;
      bool has[n_]{};
      for (int end = 0; end < 2; ++end)
        for (int dof = static_cast<int>(noise_.below(n_)); dof >= 0; dof = m_.dof_parentid[dof]) has[dof] = true;
      chain_counts_[i] = 0;
      for (int k = 0; k < n_; ++k) {
        for (int lane = 0; lane < kWidth; ++lane)
          at(J_, i * n_ + k, lane) = holders_[i] >> lane & 1 && has[k] ? number() : 0;
        if (!has[k]) continue;
        chains_[i * n_ + chain_counts_[i]++] = k;
        places_[k * kMost + place_counts_[k]++] = i;
      }
    }
    const double least = noise_.below(4) ? 6 : 0;  // of the diagonal of M
    for (int i = 0; i < n_; ++i) {
      int adr = m_.dof_Madr[i];
      for (int j = i; j >= 0; j = m_.dof_simplenum[i] ? -1 : m_.dof_parentid[j], ++adr)
        for (int lane = 0; lane < kWidth; ++lane)
          at(qM_, adr, lane) = i == j ? least + 0.1 + std::fabs(noise_()) : number();
    }
  }

  // MuJoCo's J' * D * J + M, and the sums J' * D * J
  void find_sums() {
    for (int lane = 0; lane < kWidth; ++lane) {
      mjtNum J[kMost * n_], JT[kMost * n_], D[kMost];
      int nnz[kMost], adr[kMost], colind[kMost * n_], super[kMost], nnzT[n_], adrT[n_], colindT[kMost * n_], superT[n_];
      int rows = 0, next = 0;
      std::fill_n(sums_[lane], n_ * n_, 0.0);
      for (int i = 0; i < c_.size; ++i) {
        if (!(holders_[i] >> lane & 1)) continue;
        adr[rows] = next;
        nnz[rows] = chain_counts_[i];
        for (int k = 0; k < chain_counts_[i]; ++k) {
          colind[next] = chains_[i * n_ + k];
          J[next++] = at(J_, i * n_ + chains_[i * n_ + k], lane);
        }
        D[rows++] = D_[i];
        for (int r = 0; r < n_; ++r)
          for (int c = 0; c <= r; ++c)
            sums_[lane][r * n_ + c] += at(J_, i * n_ + r, lane) * D_[i] * at(J_, i * n_ + c, lane);
      }
      Matrix& want = want_[lane];
      if (rows > 0) {
        mju_transposeSparse(JT, J, rows, n_, nnzT, adrT, colindT, nnz, adr, colind);
        mju_superSparse(rows, super, nnz, adr, colind);
        mju_superSparse(n_, superT, nnzT, adrT, colindT);
        mju_sqrMatTDSparse(want.numbers, J, JT, D, rows, n_, want.nnz, want.adr, want.columns, nnz, adr, colind, super,
                           nnzT, adrT, colindT, superT, d_);
      } else {
        for (int r = 0; r < n_; ++r) want.nnz[r] = 0, want.adr[r] = r * n_;
      }
      for (int i = 0; i < m_.nM; ++i) d_->qM[i] = at(qM_, i, lane);
      mj_addM(&m_, d_, want.numbers, want.nnz, want.adr, want.columns);
    }
  }

  // Compares the elements that MuJoCo's matrices have. After the factorisation, there are no others.
  void assert_same() {
    for (int lane = 0; lane < kWidth; ++lane) {
      const Matrix& want = want_[lane];
      for (int r = 0; r < n_; ++r)
        for (int i = 0; i < want.nnz[r]; ++i) {
          const int c = want.columns[want.adr[r] + i];
          if (c > r) continue;
          assert_true(r == c || filled_[r * n_ + c] >> lane & 1);
          assert_memory_equal(&at(H_, r * n_ + c, lane), &want.numbers[want.adr[r] + i], sizeof(double));
        }
    }
  }

  void solve(const lanes::SparseFactor& factor) {
    for (double& x : x_) x = number();
    factor.solve(lanes::vectors(solution_), lanes::vectors(x_));
    for (int lane = 0; lane < kWidth; ++lane) {
      const Matrix& want = want_[lane];
      mjtNum vec[n_], res[n_];
      for (int k = 0; k < n_; ++k) vec[k] = at(x_, k, lane);
      mju_cholSolveSparse(res, want.numbers, vec, n_, want.nnz, want.adr, want.columns);
      for (int k = 0; k < n_; ++k) assert_memory_equal(&at(solution_, k, lane), &res[k], sizeof(double));
      for (int r = 0; r < n_; ++r) {
        int count = 0;
        for (int c = 0; c < r; ++c) count += filled_[r * n_ + c] >> lane & 1;
        assert_int_equal(count + 1, want.nnz[r]);
      }
    }
  }

  // Returns whether all matrices keep their rank.
  bool update(lanes::SparseFactor& factor) {
    unsigned plus = 0, ranks = 0;
    factor.begin_vector(lanes::vectors(x_));
    for (int lane = 0; lane < kWidth; ++lane) {
      std::vector<int> own;
      for (int i = 0; i < c_.size; ++i)
        if (holders_[i] >> lane & 1) own.push_back(i);
      if (own.empty() || noise_.below(4) == 0) continue;
      const int i = own[noise_.below(own.size())];
      const bool is_plus = noise_.below(2) == 0;
      plus |= static_cast<unsigned>(is_plus) << lane;
      const double scale = noise_.below(3) ? 0.5 : 4;
      mjtNum vec[n_];
      int columns[n_];
      for (int k = 0; k < chain_counts_[i]; ++k) {
        columns[k] = chains_[i * n_ + k];
        vec[k] = at(x_, columns[k], lane) = at(J_, i * n_ + columns[k], lane) * scale;
        factor.add_element(columns[k], 1U << lane);
      }
      Matrix& want = want_[lane];
      const int rank = mju_cholUpdateSparse(want.numbers, vec, n_, is_plus, want.nnz, want.adr, want.columns,
                                            chain_counts_[i], columns, d_);
      ranks |= static_cast<unsigned>(rank < n_) << lane;
      lost += rank < n_;
    }
    assert_int_equal(factor.update(lanes::vectors(x_), lanes::mask_of(plus)), ranks);
    return ranks == 0;
  }
};

TEST(test_sparse_matrices) {
  SparseMatrices matrices;
  for (int round = 0; round < 2000; ++round) matrices.compare();
  assert_in_range(matrices.lost, 100, 10000);
  assert_in_range(matrices.mixed, 1000, 28000);
}

// mju_dotSparse, where lanes have different products, or different blocks of four. Most products are zeros of both signs.
TEST(test_sparse_sums) {
  constexpr int kMost = 14;
  const std::vector<double> ones(kMost, 1.0);
  std::vector<int> indices(kMost);
  for (int i = 0; i < kMost; ++i) indices[static_cast<std::size_t>(i)] = i;
  Noise noise;
  int negative = 0;
  for (int round = 0; round < 20000; ++round) {
    const int count = 1 + static_cast<int>(noise.below(kMost));
    const bool in_blocks = noise.below(2) == 0;
    alignas(lanes::V) double products[kMost * lanes::kWidth]{};
    unsigned char holders[kMost]{};
    std::vector<double> own[lanes::kWidth];
    for (int i = 0; i < count; ++i) {
      holders[i] = in_blocks && i % 4 != 0 ? holders[i - 1]
                                           : static_cast<unsigned char>(noise.below(std::uint64_t{1} << lanes::kWidth));
      for (int lane = 0; lane < lanes::kWidth; ++lane) {
        const double product = noise.below(8) == 0 ? noise() : noise.below(8) == 0 ? 0.0 : -0.0;
        products[i * lanes::kWidth + lane] = product;
        if (holders[i] >> lane & 1) own[lane].push_back(product);
      }
    }
    const lanes::V found = lanes::sum_of_each(lanes::vectors(products), holders, count);
    for (int lane = 0; lane < lanes::kWidth; ++lane) {
      const double want =
          mju_dotSparse(own[lane].data(), ones.data(), static_cast<int>(own[lane].size()), indices.data());
      const double got = found[lane];
      negative += want == 0 && std::signbit(want);
      assert_memory_equal(&got, &want, sizeof want);
    }
  }
  assert_true(negative > 100);
}

// Zeros of both signs in the sparse Jacobians of equalities between bodies with diagonal inertia, and in the velocities
// and accelerations of these bodies
TEST(test_zeros_of_simple_bodies) {
  const std::string slides =
      "<joint type='slide' axis='1 0 0'/><joint type='slide' axis='0 1 0'/><joint type='slide'/>"
      "<geom size='0.1' contype='0'/></body>";
  for (const char* bodies : {"body1='a' body2='b'", "body1='b' body2='a'"}) {
    std::string connects;
    for (const char* anchor : {"0 0 0", "0 0 1"})
      connects += std::string("<connect ") + bodies + " anchor='" + anchor + "'/>";
    const auto model =
        Model::parse("simple", "<mujoco><option jacobian='sparse' gravity='0 0 0'/><worldbody><body name='a'>" +
                                   slides + "<body name='b' pos='1 0 0'>" + slides + "</worldbody><equality>" +
                                   connects + "</equality></mujoco>");
    assert_true(model->get()->body_simple[1] && model->get()->body_simple[2]);
    unsigned signs = 0;
    const auto set = [&](std::size_t /*row*/, const RowState& state) {
      for (int i = 0; i < 6; ++i) {
        state.qvel[i] = signs >> i / 3 & 1 ? -0.0 : 0.0;
        state.warmstart[i] = signs >> (2 + i / 3) & 1 ? -0.0 : 0.0;
      }
      ++signs;
    };
    assert_int_equal(step_from(model, std::vector<SetState>(8, set)) + 1, 1U << lanes::widths().back());
  }
}

}  // namespace
}  // namespace mjenv::core::lanes_tests
