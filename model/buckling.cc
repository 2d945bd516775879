#include "model/buckling.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "model/dense_algebra.h"
#include "model/static_newton.h"

namespace mantle::model {
namespace {

constexpr double kFirstProbe = 1e-4;  // load factor of the first look
constexpr double kProbe = 0.02;       // then of the lowest buckling load
constexpr int kLooks = 8;
constexpr double kDifference = 1e-4;  // rad and body lengths, of fourth order
constexpr double kConverged = 1e-7;   // residual of 1 / lambda, relative to it
constexpr int kSpace = 30, kLargestSpace = 120;
constexpr double kEqual = 1e-5;       // loads that differ by less are one
constexpr double kTolerance = 1e-11;  // of the equilibria
constexpr int kIterations = 40;

/// K(e) x at the equilibrium of a load factor, by differences of the forces.
class Tangent {
 public:
  Tangent(const StaticProblem& problem)
      : problem_(problem),
        newton_(problem, kTolerance, kIterations),
        work_(problem.plant()),
        moved_(newton_.state) {}

  bool MoveTo(double factor) {
    newton_.state = problem_.Reference();
    return newton_.AtLoad(factor) == StaticNewton::Outcome::kConverged;
  }
  const std::string& reason() const { return newton_.reason(); }
  /// out += scale K x
  void Add(const VectorX& x, double scale, VectorX* out) {
    const double h = kDifference / problem_.Size(x);
    problem_.Evaluate(newton_.load_factor, &newton_.state, &inputs_, &work_);
    const StaticStep step = problem_.StepOf(work_, x);
    for (const auto& [at, weight] : {std::pair{1.0, 8.0}, {-1.0, -8.0}, {2.0, -1.0}, {-2.0, 1.0}}) {
      problem_.Move(newton_.state, step, at * h, &moved_);
      problem_.Evaluate(newton_.load_factor, &moved_, &inputs_, &work_);
      *out += (scale * weight / (12.0 * h)) * work_.force;
    }
  }

 private:
  const StaticProblem& problem_;
  StaticNewton newton_;
  PlantInputs inputs_;
  PlantWork work_;
  StaticState moved_;
};

class Buckling {
 public:
  Buckling(const Plant& plant, double time_s)
      : plant_(plant),
        problem_(plant, time_s),
        matrix_(plant),
        work_(plant),
        up_(problem_),
        down_(problem_) {}

  BucklingResult Find(int count) {
    BucklingResult out;
    StaticState rest = problem_.Reference();
    PlantInputs inputs;
    if (const auto failure = problem_.Evaluate(0.0, &rest, &inputs, &work_)) {
      out.reason = failure.Message();
      return out;
    }
    if (!matrix_.FactorAtRest(plant_, rest, inputs, work_, 0.0)) {
      out.reason = "the stiffness of the reference shape is singular";
      return out;
    }
    double probe = kFirstProbe;
    for (int look = 0; look < kLooks; ++look) {
      if (!up_.MoveTo(probe) || !down_.MoveTo(-probe)) {
        out.reason = fmt::format("no equilibrium at load factor {:.3g}: {}", probe, up_.reason());
        return out;
      }
      if (!Eigenvalues(probe, count, &out.loads)) {
        out.reason =
            fmt::format("the buckling loads did not converge in {} vectors", kLargestSpace);
        return out;
      }
      if (out.loads.empty()) break;
      const double wanted = kProbe * std::abs(out.loads[0].load_factor);
      if (look > 0 && probe <= 2.0 * wanted && probe >= 0.5 * wanted) break;
      probe = wanted;
    }
    out.ok = true;
    return out;
  }

 private:
  void Hold(VectorX* x) const {
    x->head<6>().setZero();
    for (int j = 0; j < plant_.shape_count(); ++j) {
      auto q = x->segment<3>(plant_.ShellVelocity(j));
      q = q.cwiseProduct(Vector3::Ones() - plant_.shell->nodes[j].held).eval();
    }
  }

  // -K(0)^-1 K_g x; the matrix is that of -K.
  VectorX Image(const VectorX& x, double probe) {
    VectorX y = VectorX::Zero(x.size());
    up_.Add(x, 0.5 / probe, &y);
    down_.Add(x, -0.5 / probe, &y);
    matrix_.Solve(plant_, &y);
    Hold(&y);
    return y;
  }

  bool Eigenvalues(double probe, int count, std::vector<BucklingLoad>* loads) {
    const int n = plant_.velocity_size();
    std::mt19937 random(7);
    std::uniform_real_distribution<double> uniform(-1.0, 1.0);
    Eigen::MatrixXd basis(n, kLargestSpace + 1),
        h = Eigen::MatrixXd::Zero(kLargestSpace + 1, kLargestSpace);
    VectorX start(n);
    for (double& x : start) x = uniform(random);
    Hold(&start);
    // Smooth at first: what is stiff does not buckle.
    matrix_.Solve(plant_, &start);
    Hold(&start);
    basis.col(0) = start.normalized();
    int size = 0;
    bool whole = false;
    for (int space = kSpace; space <= kLargestSpace && !whole; space *= 2) {
      for (; size < space && !whole; ++size) {
        VectorX image = Image(basis.col(size), probe);
        const double before = image.norm();
        for (int pass = 0; pass < 2; ++pass) {
          const VectorX along = basis.leftCols(size + 1).transpose() * image;
          image -= basis.leftCols(size + 1) * along;
          h.col(size).head(size + 1) += along;
        }
        h(size + 1, size) = image.norm();
        whole = !(h(size + 1, size) > 1e-9 * before);
        if (!whole) basis.col(size + 1) = image / h(size + 1, size);
      }
      if (Extract(basis, h, size, whole, count, loads)) return true;
    }
    return false;
  }

  bool Extract(const Eigen::MatrixXd& basis, const Eigen::MatrixXd& h, int size, bool whole,
               int count, std::vector<BucklingLoad>* loads) const {
    loads->clear();
    const Eigenpairs pairs = EigenpairsOf(h.topLeftCorner(size, size));
    const Eigen::VectorXcd& values = pairs.values;
    std::vector<int> order(size);
    for (int k = 0; k < size; ++k) order[k] = k;
    std::sort(order.begin(), order.end(),
              [&](int a, int b) { return std::abs(values(a)) > std::abs(values(b)); });
    for (const int k : order) {
      if (static_cast<int>(loads->size()) == count) break;
      const double inverse = values(k).real();
      if (std::abs(values(k)) < 1.0 / kLargestFactor) break;
      const double residual =
          whole ? 0.0 : std::abs(h(size, size - 1)) * std::abs(pairs.vectors(size - 1, k));
      if (residual > kConverged * std::abs(values(k))) return false;
      if (std::abs(values(k).imag()) > kEqual * std::abs(values(k))) continue;  // no real load
      const bool known = std::any_of(loads->begin(), loads->end(), [&](const BucklingLoad& l) {
        return std::abs(l.load_factor * inverse - 1.0) < kEqual;
      });
      if (known) continue;
      BucklingLoad load;
      load.load_factor = 1.0 / inverse;
      load.shape = basis.leftCols(size) * Eigen::VectorXd(pairs.vectors.col(k).real());
      Eigen::Index at;
      load.shape.cwiseAbs().maxCoeff(&at);
      load.shape /= load.shape(at);
      loads->push_back(std::move(load));
    }
    return true;
  }

  const Plant& plant_;
  StaticProblem problem_;
  NewtonMatrix matrix_;
  PlantWork work_;
  Tangent up_, down_;
};

}  // namespace

BucklingResult FindBucklingLoads(const Plant& plant, double time_s, int count) {
  return Buckling(plant, time_s).Find(count);
}

}  // namespace mantle::model
