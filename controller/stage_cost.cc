#include "controller/stage_cost.h"

#include <algorithm>
#include <cmath>

namespace mantle::controller {
namespace {

using model::Hat;
using model::Matrix3;
using Quantity = SoftBound::Quantity;

constexpr double kTiny = 1e-9;  // of a norm whose direction is needed

double Outside(double x, const SoftBound& b) {
  if (x > b.high) return x - b.high;
  return x < b.low ? x - b.low : 0.0;
}

}  // namespace

StageCost::StageCost(const ReducedModel& model, const ControlOptions& options,
                     const Reference& reference)
    : model_(model), options_(options), reference_(reference) {
  std::vector<double> weights;
  const auto add = [&](std::string_view name, double weight, int count, int* first) {
    if (weight <= 0) return;
    *first = static_cast<int>(weights.size());
    terms_.push_back({name, *first, count});
    weights.insert(weights.end(), count, weight);
  };
  const CostWeights& c = options.cost;
  if (reference.has_position()) add("position", c.position, 3, &position_);
  if (!reference.has_tip()) {
    add("heading", c.heading, 3, &heading_);
    add("velocity", c.velocity, 3, &velocity_);
  }
  add("turn_rate", c.turn_rate, 3, &turn_);
  if (reference.has_tip()) {
    add("tip", c.tip, 3, &tip_);
    tip_jacobian_.resize(3, model.arms[reference.arm()].size());
  }
  const bool bounds_volume =
      std::any_of(options.bounds.begin(), options.bounds.end(),
                  [](const auto& b) { return b.quantity == Quantity::kVolume; });
  if (model.mantle) {
    add("volume", c.volume, 1, &volume_);
    if (volume_ >= 0 || bounds_volume) {
      volume_function_.emplace_back(*model.mantle);
      const VectorX rest = VectorX::Zero(model.mantle->size);
      reference_volume_m3_ = volume_function_[0].Evaluate(rest.data());
    }
  }
  bounds_ = static_cast<int>(weights.size());
  for (const SoftBound& b : options.bounds) {
    if (b.quantity != Quantity::kCurvature) {
      weights.push_back(b.weight);
      continue;
    }
    groups_ = 0;
    for (std::size_t a = 0; a < model.arms.size(); ++a) {
      const reduced::StrainBasis& basis = model.arms[a].basis;
      for (std::size_t g = 0; g < basis.groups().size(); ++g) {
        const auto& group = basis.groups()[g];
        reduced::Matrix6X b6;
        basis.Evaluate(static_cast<int>(g), 0.5 * (group.from_m + group.to_m), &b6);
        bends_.push_back({model.arm_first(static_cast<int>(a)) + group.first,
                          Eigen::Matrix2Xd(b6.middleRows<2>(1))});
        weights.push_back(b.weight);
        ++groups_;
      }
    }
  }
  const int outside = static_cast<int>(weights.size()) - bounds_;
  if (outside > 0) terms_.push_back({"bounds", bounds_, outside});
  weights_ = Eigen::Map<const VectorX>(weights.data(), static_cast<Eigen::Index>(weights.size()));
}

void StageCost::Evaluate(const ReducedState& s, VectorX* residual, Eigen::MatrixXd* jacobian) {
  const ReferencePoint ref = reference_.At(s.time_s);
  const Matrix3 r = s.root.rotation.toRotationMatrix();
  const Vector3 w = s.v.head<3>(), v = s.v.segment<3>(3);
  const Eigen::Index rates = s.v.size();  // first column of dv
  if (jacobian != nullptr) jacobian->setZero();
  if (position_ >= 0) {
    residual->segment<3>(position_) = s.root.position - ref.position;
    if (jacobian != nullptr) jacobian->block<3, 3>(position_, 3) = r;
  }
  if (heading_ >= 0) {
    residual->segment<3>(heading_) = r.col(2) - ref.direction;
    if (jacobian != nullptr) {
      jacobian->block<3, 3>(heading_, 0).noalias() = -r * Hat(Vector3::UnitZ());
    }
  }
  if (velocity_ >= 0) {
    residual->segment<3>(velocity_) = r * v - ref.velocity;
    if (jacobian != nullptr) {
      jacobian->block<3, 3>(velocity_, 0).noalias() = -r * Hat(v);
      jacobian->block<3, 3>(velocity_, rates + 3) = r;
    }
  }
  if (turn_ >= 0) {
    residual->segment<3>(turn_) = w;
    if (jacobian != nullptr) jacobian->block<3, 3>(turn_, rates).setIdentity();
  }
  if (tip_ >= 0) {
    const int first = model_.arm_first(reference_.arm());
    Eigen::Ref<Eigen::Matrix3Xd> dq(tip_jacobian_);
    const model::Pose tip = EvaluateTip(model_.arms[reference_.arm()], s.q.data() + first,
                                        jacobian == nullptr ? nullptr : &dq);
    residual->segment<3>(tip_) = s.root.position + r * tip.position - ref.tip;
    if (jacobian != nullptr) {
      jacobian->block<3, 3>(tip_, 0).noalias() = -r * Hat(tip.position);
      jacobian->block<3, 3>(tip_, 3) = r;
      jacobian->block(tip_, 6 + first, 3, dq.cols()).noalias() = r * dq;
    }
  }
  if (volume_ >= 0) {
    const double u = volume_function_[0].Evaluate(s.q.data() + model_.mantle_first());
    (*residual)(volume_) = u / reference_volume_m3_ - 1.0;
    if (jacobian != nullptr) {
      jacobian->row(volume_).segment(6 + model_.mantle_first(), model_.mantle->size) =
          volume_function_[0].gradient().transpose() / reference_volume_m3_;
    }
  }
  EvaluateBounds(s, bounds_, residual, jacobian);
}

void StageCost::EvaluateBounds(const ReducedState& s, int row, VectorX* residual,
                               Eigen::MatrixXd* jacobian) {
  const Eigen::Index rates = s.v.size();
  std::size_t bend = 0;
  for (const SoftBound& b : options_.bounds) {
    if (b.quantity == Quantity::kVolume) {
      const double u = volume_function_[0].Evaluate(s.q.data() + model_.mantle_first());
      (*residual)(row) = Outside(u / reference_volume_m3_, b);
      if (jacobian != nullptr && (*residual)(row) != 0) {
        jacobian->row(row).segment(6 + model_.mantle_first(), model_.mantle->size) =
            volume_function_[0].gradient().transpose() / reference_volume_m3_;
      }
      ++row;
    } else if (b.quantity == Quantity::kCurvature) {
      for (std::size_t g = 0; g < groups_; ++g, ++bend, ++row) {
        const Bend& k = bends_[bend];
        const Eigen::Vector2d strain = k.basis.lazyProduct(s.q.segment(k.first, k.basis.cols()));
        const double size = strain.norm();
        (*residual)(row) = Outside(size, b);
        if (jacobian != nullptr && (*residual)(row) != 0 && size > kTiny) {
          jacobian->row(row).segment(6 + k.first, k.basis.cols()).noalias() =
              (strain / size).transpose().lazyProduct(k.basis);
        }
      }
    } else {
      const Eigen::Index at = b.quantity == Quantity::kSpeed ? 3 : 0;
      const Vector3 x = s.v.segment<3>(at);
      const double size = x.norm();
      (*residual)(row) = Outside(size, b);
      if (jacobian != nullptr && (*residual)(row) != 0 && size > kTiny) {
        jacobian->block<1, 3>(row, rates + at) = x.transpose() / size;
      }
      ++row;
    }
  }
}

double StageCost::EffortValue(const Eigen::Ref<const VectorX>& u) const {
  return options_.cost.effort * u.squaredNorm();
}

double StageCost::RateValue(const Eigen::Ref<const VectorX>& rate) const {
  return options_.cost.rate * rate.squaredNorm();
}

}  // namespace mantle::controller
