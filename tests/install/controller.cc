// A solver of the user's own enters by the factory; without one, the message says what to do.
#include <string>

#include "controller/program.h"

namespace {

class Solves : public mantle::controller::Solver {
 public:
  void Solve(mantle::controller::Program&, const mantle::controller::SolveOptions&,
             mantle::controller::SolveResult* result) override {
    result->status = mantle::controller::SolveStatus::kSolved;
  }
};

}  // namespace

int main() {
  using namespace mantle::controller;
  try {
    MakeSolver();
    return 1;
  } catch (const std::exception& error) {
    if (std::string(error.what()).find("mantle::ipopt") == std::string::npos) return 2;
  }
  SetSolverFactory([]() -> std::unique_ptr<Solver> { return std::make_unique<Solves>(); });
  return MakeSolver() != nullptr && ToString(SolveStatus::kSolved) == "solved" ? 0 : 3;
}
