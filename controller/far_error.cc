#include "controller/far_error.h"

#include <cmath>

namespace mantle::controller {
namespace {

// Of the body's length: pulses move the root by some hundredths of it a second, cables a tip by
// tenths.
constexpr double kFarRoot = 0.02, kFarTip = 0.1, kFarSpeed = 0.05;

}  // namespace

FarError::FarError(const StageCost& cost, const ReducedModel& model)
    : cost_(cost),
      far_root_m_(kFarRoot * model.body_length_m),
      far_m_s_(kFarSpeed * model.body_length_m / cost.options().gait.period_s) {
  for (const StageCost::Term& term : cost.terms()) {
    if (term.name == "position") {
      rows_.push_back({term.first, term.count, far_root_m_});
    } else if (term.name == "tip") {
      rows_.push_back({term.first, term.count, kFarTip * model.body_length_m});
    } else if (term.name == "velocity") {
      rows_.push_back({term.first, term.count, far_m_s_});
    }
  }
}

double FarError::Factor(double square, double far) {
  return 1 / std::sqrt(1 + square / (far * far));
}

// 2 far^2 (root - 1) without its cancellation
double FarError::Rho(double square, double far) {
  return 2 * square / (1 + std::sqrt(1 + square / (far * far)));
}

void FarError::Weigh(const VectorX& residual, VectorX* weights) const {
  *weights = cost_.weights();
  for (const Rows& rows : rows_) {
    const double square = residual.segment(rows.first, rows.count).squaredNorm();
    weights->segment(rows.first, rows.count) *= Factor(square, rows.far);
  }
}

double FarError::Value(const VectorX& residual) const {
  double value = cost_.Value(residual);
  for (const Rows& rows : rows_) {
    const double square = residual.segment(rows.first, rows.count).squaredNorm();
    value += cost_.weights()(rows.first) * (Rho(square, rows.far) - square);
  }
  return value;
}

}  // namespace mantle::controller
