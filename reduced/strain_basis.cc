#include "reduced/strain_basis.h"

#include <fmt/format.h>

#include <array>
#include <cmath>

#include "model/rod.h"
#include "reduced/quadrature.h"

namespace mantle::reduced {
namespace {

using model::BadRobot;

constexpr int kMaxDegree = 12;
constexpr double kShortest = 1e-6;  // of the arm's length: a segment shorter than that is refused

std::vector<double> SegmentEnds(const ArmReduction& reduction, double length) {
  std::vector<double> ends = reduction.segment_ends_m;
  if (ends.empty()) {
    if (reduction.segments < 1) {
      throw BadRobot(fmt::format("segments = {}, must be >= 1", reduction.segments));
    }
    for (int i = 1; i <= reduction.segments; ++i) ends.push_back(length * i / reduction.segments);
  }
  double last = 0;
  for (double end : ends) {
    if (!(end - last > kShortest * length)) {
      throw BadRobot(
          fmt::format("segment_ends = {:.6g} m: a segment of {:.3g} m, must be longer "
                      "than {:.3g} m",
                      end, end - last, kShortest * length));
    }
    last = end;
  }
  if (std::abs(last - length) > kShortest * length) {
    throw BadRobot(
        fmt::format("segment_ends: the last one = {:.6g} m, must be the arm's length "
                    "{:.6g} m",
                    last, length));
  }
  ends.back() = length;
  return ends;
}

}  // namespace

StrainBasis::StrainBasis(const ArmReduction& reduction, double length_m)
    : kind_(reduction.basis), degree_(reduction.degree), length_(length_m) {
  for (int i = 0; i < 6; ++i) {
    if (reduction.strains[i]) components_.push_back(i);
  }
  if (components_.empty()) throw BadRobot("strains: none chosen, needs at least one");
  const int count = static_cast<int>(components_.size());
  if (kind_ == BasisKind::kLegendre) {
    if (degree_ < 0 || degree_ > kMaxDegree) {
      throw BadRobot(fmt::format("degree = {}, must be in [0, {}]", degree_, kMaxDegree));
    }
    size_ = count * (degree_ + 1);
    groups_.push_back({0.0, length_m, 0, size_});
    return;
  }
  double from = 0;
  for (double end : SegmentEnds(reduction, length_m)) {
    groups_.push_back({from, end, size_, count});
    size_ += count;
    from = end;
  }
}

void StrainBasis::Evaluate(int group, double x_m, Matrix6X* basis) const {
  const int count = static_cast<int>(components_.size());
  basis->setZero(6, groups_[group].columns);
  if (kind_ == BasisKind::kConstant) {
    for (int i = 0; i < count; ++i) (*basis)(components_[i], i) = 1.0;
    return;
  }
  std::array<double, kMaxDegree + 1> p;
  LegendrePolynomials(degree_, 2.0 * x_m / length_ - 1.0, p.data());
  for (int d = 0; d <= degree_; ++d) {
    for (int i = 0; i < count; ++i) (*basis)(components_[i], d * count + i) = p[d];
  }
}

std::vector<double> StrainBasis::PieceEnds() const {
  std::vector<double> ends;
  if (kind_ == BasisKind::kConstant) {
    for (const StrainGroup& g : groups_) ends.push_back(g.to_m);
  } else {
    for (int i = 1; i <= degree_ + 1; ++i) ends.push_back(length_ * i / (degree_ + 1));
  }
  return ends;
}

int StrainBasis::GroupOf(double x_m) const {
  for (std::size_t g = 0; g + 1 < groups_.size(); ++g) {
    if (x_m < groups_[g].to_m) return static_cast<int>(g);
  }
  return static_cast<int>(groups_.size()) - 1;
}

}  // namespace mantle::reduced
