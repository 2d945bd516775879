// Linking is enough: MakeSolver() gives Ipopt, which minimises (x - 3)^2 / 2 on x <= 2.
#include <cmath>

#include "controller/program.h"

namespace {

using namespace mantle::controller;

class Parabola : public Program {
 public:
  int variables() const override { return 1; }
  int constraints() const override { return 0; }
  void Bounds(double* low, double* high, double*, double*) const override {
    *low = -kInfinity;
    *high = 2.0;
  }
  void Start(double* x) const override { *x = 0.0; }
  const SparsePattern& JacobianPattern() const override { return none_; }
  const SparsePattern& HessianPattern() const override { return one_; }
  bool quadratic() const override { return true; }
  bool Objective(const double* x, bool, double* f) override {
    *f = 0.5 * (*x - 3.0) * (*x - 3.0);
    return true;
  }
  bool Gradient(const double* x, bool, double* gradient) override {
    *gradient = *x - 3.0;
    return true;
  }
  bool Constraints(const double*, bool, double*) override { return true; }
  bool Jacobian(const double*, bool, double*) override { return true; }
  bool Hessian(const double*, bool, double factor, const double*, double* values) override {
    *values = factor;
    return true;
  }

 private:
  SparsePattern none_, one_{{0}, {0}};
};

}  // namespace

int main() {
  Parabola program;
  SolveResult result;
  MakeSolver()->Solve(program, {}, &result);
  // The barrier leaves some 1e-4 of the way to the bound.
  return result.usable() && std::abs(result.x(0) - 2.0) < 1e-3 ? 0 : 1;
}
