#include "model/motion_modes.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>
#include <stdexcept>
#include <utility>

#include "model/dense_algebra.h"
#include "model/newton_matrix.h"

namespace mantle::model {
namespace {

constexpr double kConverged = 1e-9;  // residual of an eigenpair, relative to its eigenvalue
constexpr double kSafety = 10.0;     // between a residual and what it may do to a sign
constexpr int kFirstSize = 40;       // of the Krylov space; doubled where that is too small
constexpr int kLargestSize = 320;
constexpr int kLargestSizeForSign = 160;
constexpr double kVelocityProbe = 1e-4;  // rad/s and m/s
constexpr double kGrowth = 1e-6;         // of |lambda|: a real part below is round-off
constexpr double kFreeShift = 0.3;       // of the lowest rate: keeps a free root's matrix regular

// (p, q) -> (x, y) with (companion - shift)(x, y) = (p, q), y scaled by 1 / rate.
class ShiftInverse {
 public:
  ShiftInverse(const Plant& plant, const PlantState& rest, const PlantInputs& inputs)
      : plant_(plant),
        rest_(rest),
        moved_(rest),
        inputs_(inputs),
        work_(plant),
        probe_(plant),
        matrix_(plant) {
    const int n = plant.velocity_size();
    for (VectorX* v : {&force_, &product_, &image_}) v->setZero(n);
    if (const EvaluationFailure failure = EvaluateForces(plant, rest, inputs, &work_)) {
      throw std::runtime_error("modes: " + failure.Message());
    }
    // A first look at the scale, by inverse iteration with a shift that is surely not too small.
    Factor(plant.root_free() ? 0.01 : 0.0);
    std::mt19937 random(7);
    std::uniform_real_distribution<double> uniform(-1.0, 1.0);
    start_.resize(2 * n);
    for (double& x : start_) x = uniform(random);
    Hold(&start_);
    VectorX x = start_.head(n);
    for (int k = 0; k < 4; ++k) {
      const double before = x.norm();
      Mass(x, &product_);
      matrix_.Solve(plant_, &product_);
      x = product_;
      rate_ = std::sqrt(before / x.norm());
      x /= x.norm();
    }
    if (!std::isfinite(rate_) || !(rate_ > 0.0)) {
      throw std::runtime_error("modes: the robot has no inertia or no stiffness");
    }
    if (plant.root_free()) Factor(kFreeShift * rate_);
  }

  double shift() const { return shift_; }
  const VectorX& start() const { return start_; }

  void Apply(const VectorX& from, VectorX* to) {
    const auto n = from.size() / 2;
    const VectorX p = from.head(n), q = rate_ * from.tail(n);
    // x = -A^-1 (M (q + s p) - D p), y = p + s x
    Mass(q + shift_ * p, &force_);
    Damping(p, &image_);
    force_ -= image_;
    matrix_.Solve(plant_, &force_);
    to->head(n) = -force_;
    to->tail(n) = (p - shift_ * force_) / rate_;
    Hold(to);
  }

 private:
  void Factor(double shift) {
    shift_ = shift;
    if (!matrix_.FactorAtRest(plant_, rest_, inputs_, work_, shift)) {
      throw std::runtime_error("modes: the stiffness matrix is singular");
    }
  }
  void Hold(VectorX* z) const {
    const auto n = z->size() / 2;
    for (const auto offset : {Eigen::Index{0}, n}) {
      if (!plant_.root_free()) z->segment<6>(offset).setZero();
      for (int j = 0; j < plant_.shape_count(); ++j) {
        auto q = z->segment<3>(offset + plant_.ShellVelocity(j));
        q = q.cwiseProduct(Vector3::Ones() - plant_.shell->nodes[j].held).eval();
      }
    }
  }
  void Mass(const VectorX& x, VectorX* out) {
    ApplyMass(plant_, work_, x, out);
    if (!plant_.root_free()) out->head<6>().setZero();
  }
  // (D - M ad_eta) p. About rest the part of f that is odd in v is D v and what goes with |v| v
  // (drag, jet); F(e) of a velocity e p and F(e/2) tell them apart: D p = (4 F(e/2) - F(e)) / e.
  void Damping(const VectorX& p, VectorX* out) {
    const double size = p.cwiseAbs().maxCoeff();
    out->setZero();
    if (size == 0.0) return;
    const double probe = kVelocityProbe / size;
    for (const auto& [share, weight] : {std::pair{0.5, 4.0}, std::pair{1.0, -1.0}}) {
      for (const double sign : {1.0, -1.0}) {
        moved_.velocity = rest_.velocity + (sign * share * probe) * p;
        EvaluateForces(plant_, moved_, inputs_, &probe_);
        *out += (0.5 * sign * weight / probe) * probe_.force;
      }
    }
    product_ = p;
    for (int a = 0; a < static_cast<int>(plant_.rods.size()); ++a) {
      for (int i = 1; i <= plant_.rods[a].element_count(); ++i) {
        const int at = plant_.ArmVelocity(a, i);
        const Vector6 eta = rest_.velocity.segment<6>(at);
        product_.segment<6>(at) = SmallAdjointTimes(eta, p.segment<6>(at));
      }
    }
    product_.head<6>().setZero();
    product_.tail(3 * plant_.shape_count()).setZero();
    VectorX& frame = force_by_frame_;
    frame.setZero(p.size());
    Mass(product_, &frame);
    *out -= frame;
    if (!plant_.root_free()) out->head<6>().setZero();
  }

  const Plant& plant_;
  const PlantState& rest_;
  PlantState moved_;
  const PlantInputs& inputs_;
  PlantWork work_, probe_;
  NewtonMatrix matrix_;
  VectorX force_, product_, image_, start_, force_by_frame_;
  double shift_{0}, rate_{1};
};

// Modes out of a Krylov space of m vectors; false where the `count` nearest have not converged.
bool FromSpace(const Eigen::MatrixXd& basis, const Eigen::MatrixXd& h, int m, bool whole,
               double shift, int count, MotionAccuracy accuracy, std::vector<MotionMode>* modes) {
  const auto [values, vectors] = EigenpairsOf(h.topLeftCorner(m, m));
  const double largest = values.cwiseAbs().maxCoeff();
  std::vector<int> order;
  for (int k = 0; k < m; ++k) {
    // mu = 1 / (lambda - shift), Im mu <= 0 where Im lambda >= 0; tiny ones are what a space larger
    // than the problem adds.
    if (values(k).imag() <= 0.0 && std::abs(values(k)) > 1e-13 * largest) order.push_back(k);
  }
  std::sort(order.begin(), order.end(),
            [&](int a, int b) { return std::abs(values(a)) > std::abs(values(b)); });
  const auto n = basis.rows() / 2;
  modes->clear();
  for (const int k : order) {
    if (static_cast<int>(modes->size()) == count) break;
    const double residual = std::abs(h(m, m - 1)) * std::abs(vectors(m - 1, k));
    MotionMode mode;
    mode.rate_1_s = shift + 1.0 / values(k);
    // d lambda = -d mu / mu^2
    const bool certain = accuracy == MotionAccuracy::kSign &&
                         kSafety * residual < std::abs(mode.rate_1_s.real()) * std::norm(values(k));
    if (!whole && !certain && residual > kConverged * std::abs(values(k))) return false;
    mode.shape = basis.topLeftCorner(n, m) * vectors.col(k);
    Eigen::Index at;
    mode.shape.cwiseAbs().maxCoeff(&at);
    mode.shape /= mode.shape(at);
    modes->push_back(std::move(mode));
  }
  std::stable_sort(modes->begin(), modes->end(), [](const MotionMode& a, const MotionMode& b) {
    return std::abs(a.rate_1_s) < std::abs(b.rate_1_s);
  });
  return true;
}

}  // namespace

double MotionMode::frequency_hz() const {
  return std::abs(rate_1_s.imag()) / (2.0 * std::numbers::pi);
}
double MotionMode::damping_ratio() const {
  const double size = std::abs(rate_1_s);
  return size > 0.0 ? -rate_1_s.real() / size : 0.0;
}
bool MotionMode::unstable() const { return rate_1_s.real() > kGrowth * std::abs(rate_1_s); }

std::vector<MotionMode> MotionModes(const Plant& plant, const PlantState& rest,
                                    const PlantInputs& inputs, int count, MotionAccuracy accuracy) {
  ShiftInverse inverse(plant, rest, inputs);
  const int n = static_cast<int>(inverse.start().size());
  std::vector<MotionMode> modes;
  int done = 0;
  Eigen::MatrixXd basis(n, 0), h(0, 0);
  bool whole = false;  // the space is invariant: its eigenvalues are exact
  const int largest = accuracy == MotionAccuracy::kSign ? kLargestSizeForSign : kLargestSize;
  for (int size = std::max(kFirstSize, 4 * count); size <= largest && !whole; size *= 2) {
    basis.conservativeResize(n, size + 1);
    Eigen::MatrixXd grown = Eigen::MatrixXd::Zero(size + 1, size);
    grown.topLeftCorner(h.rows(), h.cols()) = h;
    h = grown;
    if (done == 0) basis.col(0) = inverse.start().normalized();
    VectorX image(n);
    for (; done < size && !whole; ++done) {
      inverse.Apply(basis.col(done), &image);
      const double before = image.norm();
      const auto space = basis.leftCols(done + 1);
      for (int pass = 0; pass < 2; ++pass) {
        const VectorX along = space.transpose() * image;
        image -= space * along;
        h.col(done).head(done + 1) += along;
      }
      h(done + 1, done) = image.norm();
      whole = !(h(done + 1, done) > 1e-13 * before);
      if (!whole) basis.col(done + 1) = image / h(done + 1, done);
    }
    if (FromSpace(basis, h, done, whole, inverse.shift(), count, accuracy, &modes)) return modes;
  }
  throw std::runtime_error(
      fmt::format("modes: the {} modes nearest to zero did not converge in a space of {} vectors",
                  count, done));
}

}  // namespace mantle::model
