#include "tools/studies/search.h"

#include <nlopt.h>

#include <cmath>
#include <exception>
#include <limits>
#include <memory>
#include <new>

namespace mantle::tools {
namespace {

constexpr double kFinest = 2e-3;      // of the box: a search ends where its steps are smaller
constexpr double kWorthwhile = 1e-3;  // gain of a whole search below which no other follows
constexpr unsigned long kSeed = 1;

nlopt_algorithm AlgorithmOf(SearchMethod method) {
  switch (method) {
    case SearchMethod::kBobyqa:
      return NLOPT_LN_BOBYQA;
    case SearchMethod::kCrs:
      return NLOPT_GN_CRS2_LM;
    default:
      return NLOPT_LN_SBPLX;
  }
}

// What the callback needs. NLopt is C: nothing may be thrown through it.
struct Call {
  const std::function<double(const std::vector<double>&)>& objective;
  const std::function<bool()>& stop;
  nlopt_opt handle;
  int most;
  SearchResult best;
  std::exception_ptr error;
};

double Evaluate(unsigned n, const double* x, double*, void* data) noexcept {
  Call& call = *static_cast<Call*>(data);
  try {
    if (call.best.evaluations >= call.most || call.stop()) {  // some methods overdraw
      nlopt_force_stop(call.handle);
      return call.best.value;
    }
    const std::vector<double> point(x, x + n);
    const double value = call.objective(point);
    ++call.best.evaluations;
    if (value < call.best.value) {
      call.best.value = value;
      call.best.x = point;
    }
    return value;
  } catch (...) {
    call.error = std::current_exception();
    nlopt_force_stop(call.handle);
    return call.best.value;
  }
}

}  // namespace

SearchResult Minimise(SearchMethod method, const std::vector<double>& start, double step,
                      int evaluations,
                      const std::function<double(const std::vector<double>&)>& objective,
                      const std::function<bool()>& stop) {
  const std::unique_ptr<nlopt_opt_s, void (*)(nlopt_opt)> handle(
      nlopt_create(AlgorithmOf(method), static_cast<unsigned>(start.size())), nlopt_destroy);
  if (!handle) throw std::bad_alloc();
  Call call{
      objective, stop, handle.get(), evaluations, {start, std::numeric_limits<double>::max(), 0},
      {}};
  nlopt_srand(kSeed);
  nlopt_set_lower_bounds1(handle.get(), 0.0);
  nlopt_set_upper_bounds1(handle.get(), 1.0);
  nlopt_set_initial_step1(handle.get(), step);
  nlopt_set_xtol_abs1(handle.get(), kFinest);
  nlopt_set_min_objective(handle.get(), Evaluate, &call);
  while (call.best.evaluations < evaluations) {
    const double before = call.best.value;
    nlopt_set_maxeval(handle.get(), evaluations - call.best.evaluations);
    std::vector<double> x = call.best.x;
    double value = 0;
    nlopt_optimize(handle.get(), x.data(), &value);
    if (call.error) std::rethrow_exception(call.error);
    if (stop() || call.best.value > before - kWorthwhile * std::abs(before)) break;
  }
  return call.best;
}

}  // namespace mantle::tools
