#include <fmt/format.h>

#include <algorithm>

#include "model/arm_section.h"
#include "model/robot_schema.h"

namespace mantle::model {
namespace {

using schema::kAnyValue;
using schema::Key;
using schema::kNonNegative;
using schema::kOneOrMore;
using schema::kPositive;
using schema::Optional;
using schema::Presence;
using schema::Quantity;
using schema::Range;
using schema::Required;
using schema::Visitor;

// A length, constant or [base, tip].
bool DescribeTaper(Visitor& v, const Key& key, schema::Range range, Taper* taper) {
  bool given = false;
  v.Either(
      key, schema::Form::kArray,
      [&] {
        std::vector<double> both(2);
        if (v.Numbers(key, Quantity::kLength, range, 2, &both)) {
          *taper = {both[0], both[1]};
          given = true;
        }
      },
      [&] {
        if (v.Number(key, Quantity::kLength, range, &taper->base)) {
          taper->tip = taper->base;
          given = true;
        }
      });
  return given;
}

// The outline's keys; `other` is what may stand in their place. Returns whether there is one.
bool DescribeOutline(Visitor& v, const char* other, bool needed, ArmPiece& piece) {
  RoundOutline round;
  const std::string one_of = fmt::format("this, or `width` and `height`{}", other);
  const bool is_round = DescribeTaper(
      v, Optional({.name = "radius", .meaning = "constant, or [base, tip]", .also = one_of}),
      kPositive, &round.radius_m);
  if (DescribeTaper(v,
                    Optional({.name = "inner_radius",
                              .meaning = "of a hollow section, constant or [base, tip]",
                              .fallback = "0: solid",
                              .bound = "[0, `radius`)"}),
                    kNonNegative, &round.inner_radius_m)) {
    v.Demand(is_round, "inner_radius", "needs `radius`");
  }
  RectangularOutline box;
  const bool wide = DescribeTaper(v, Optional({"width", "of a rectangular section, along y"}),
                                  kPositive, &box.width_m);
  const bool high = DescribeTaper(v, Optional({"height", "along z"}), kPositive, &box.height_m);
  v.Boolean(
      {.name = "flooded", .meaning = "a hollow section holds water: it displaces its wall alone"},
      &piece.flooded);
  if (v.describing()) return true;
  v.Demand(wide == high, wide ? "width" : "height", "`width` and `height` go together");
  v.Demand(!(is_round && wide), "width", "contradicts `radius`: a section has one outline");
  const bool hollow = std::max(round.inner_radius_m.base, round.inner_radius_m.tip) > 0.0;
  v.Demand(!piece.flooded || hollow, "flooded", "needs a hollow section (`inner_radius`)");
  v.Demand(is_round || wide || !needed, "radius",
           fmt::format("is missing: must be given, or `width` and `height`{}", other));
  if (wide) {
    piece.outline = box;
  } else {
    piece.outline = round;
  }
  return is_round || wide;
}

// A full stiffness of a section.
bool DescribeStiffnessMatrix(Visitor& v, std::optional<Matrix6>* stiffness) {
  std::vector<double> n;
  if (!v.Numbers(Optional({.name = "stiffness_matrix",
                           .meaning = "6 x 6, row by row: twist, bending y, z, stretch, shear y, z",
                           .also = "symmetric, positive definite; instead of `stiffness`",
                           .unit = "N m^2, N m, N"}),
                 Quantity::kNumber, kAnyValue, 36, &n)) {
    return false;
  }
  v.Demand(!v.Has("stiffness"), "stiffness_matrix", "contradicts `stiffness`: only one of them");
  *stiffness = Eigen::Map<const Eigen::Matrix<double, 6, 6, Eigen::RowMajor>>(n.data());
  return true;
}

// The sections' matrices; returns whether stiffness and inertia both are given.
bool DescribeMatrices(Visitor& v, ArmPiece& piece) {
  std::optional<Vector6> diagonal;
  if (v.Diagonal({"stiffness", "diagonal, constant along it", "from material"},
                 Quantity::kSectionStiffness, kPositive, &diagonal)) {
    piece.stiffness = Matrix6(diagonal->asDiagonal());
  }
  DescribeStiffnessMatrix(v, &piece.stiffness);
  v.Diagonal({"damping", "diagonal; acts with `effects.viscosity`", "from material"},
             Quantity::kSectionDamping, kNonNegative, &piece.viscosity);
  v.Diagonal({"inertia", "diagonal", "from material"}, Quantity::kSectionInertia, kPositive,
             &piece.inertia);
  return piece.stiffness && piece.inertia;
}

void DescribePiece(Visitor& v, const Material& of_arm, bool arm_has_material, ArmPiece& piece) {
  v.Number(Required({"length"}), Quantity::kLength, kPositive, &piece.length_m);
  DescribeOutline(v, "", true, piece);
  const bool given = DescribeMatrices(v, piece);
  piece.material = of_arm;
  const bool needed = !v.describing() && !given && !arm_has_material;
  DescribeMaterial(v,
                   {.name = "material",
                    .fallback = "the arm's",
                    .presence = needed ? Presence::kRequired : Presence::kOptional},
                   &piece.material);
  v.Number({"shear_correction", "factor on the shear stiffness"}, Quantity::kNumber, kPositive,
           &piece.shear_correction);
  v.Boolean({"rigid", "does not strain: a million times as stiff as the stiffest other piece"},
            &piece.rigid);
}

// A radius that is linear between given places: a piece for each, without nodes where they meet.
void DescribeProfile(Visitor& v, double length_m, const ArmPiece& like,
                     std::vector<ArmPiece>* pieces) {
  std::vector<double> at, radius;
  v.Numbers(Required({.name = "at",
                      .meaning = "arc lengths, from the base to the tip",
                      .bound = "0, ..., `length`, ascending"}),
            Quantity::kLength, Range{0, length_m}, kOneOrMore, &at);
  v.Numbers(Required({"radius", "one per `at`, linear between"}), Quantity::kLength, kPositive,
            v.describing() ? kOneOrMore : static_cast<int>(at.size()), &radius);
  if (v.describing()) return;
  v.Demand(at.size() >= 2 && at.front() == 0.0 && at.back() == length_m, "at",
           "must go from 0 m to the arm's length");
  for (std::size_t i = 1; i < at.size(); ++i) {
    v.Demand(at[i] > at[i - 1], "at", "must ascend");
    ArmPiece piece = like;
    piece.length_m = at[i] - at[i - 1];
    piece.outline = RoundOutline{{radius[i - 1], radius[i]}, {}};
    piece.node_at_end = false;
    pieces->push_back(piece);
  }
}

}  // namespace

void DescribeSections(Visitor& v, Arm& arm) {
  const bool pieces = v.Has("pieces"), profile = v.Has("radius_profile");
  ArmPiece own;
  own.length_m = arm.length_m;
  DescribeOutline(v, ", or `radius_profile`, or `pieces`", !pieces && !profile, own);
  const bool given = DescribeMatrices(v, own);
  // Sections that are given in full need no material, nor does an arm whose pieces have theirs.
  const bool needed = !v.describing() && !given && !pieces;
  const bool has_material =
      DescribeMaterial(v,
                       {.name = "material",
                        .also = "unless `stiffness` and `inertia`, or `pieces` are given",
                        .presence = needed ? Presence::kRequired : Presence::kOptional},
                       &own.material);
  v.Number({"shear_correction", "factor on the shear stiffness"}, Quantity::kNumber, kPositive,
           &own.shear_correction);
  v.Table(Optional({.name = "radius_profile",
                    .meaning = "of a round, solid arm: `at`, `radius`, arrays of one length",
                    .also = "instead of `radius`"}),
          [&](Visitor& t) { DescribeProfile(t, arm.length_m, own, &arm.pieces); });
  v.Tables(Optional({.name = "pieces",
                     .meaning = "from base to tip, with a node wherever two meet",
                     .also = "instead of the keys of its one section; lengths add up to `length`"}),
           [&](Visitor& t, int) {
             DescribePiece(t, own.material, has_material, arm.pieces.emplace_back());
           });
  if (v.describing()) return;
  for (const char* key : {"radius", "inner_radius", "width", "height", "stiffness",
                          "stiffness_matrix", "damping", "inertia"}) {
    v.Demand(!(pieces && v.Has(key)), key, "contradicts `pieces`: give it in each piece");
  }
  for (const char* key : {"radius", "inner_radius", "width", "height"}) {
    v.Demand(!(profile && v.Has(key)), key,
             "contradicts `radius_profile`: a section has one outline");
  }
  v.Demand(!(pieces && profile), "radius_profile", "contradicts `pieces`: give one of them");
  v.Demand(!(pieces && own.shear_correction != 1.0), "shear_correction",
           "contradicts `pieces`: give it in each piece");
  arm.material = own.material;
  arm.shear_correction = own.shear_correction;
  const auto* round = std::get_if<RoundOutline>(&own.outline);
  const bool plain = round != nullptr && round->inner_radius_m.base == 0.0 &&
                     round->inner_radius_m.tip == 0.0 && !v.Has("stiffness_matrix");
  if (arm.pieces.empty() && plain) {
    arm.radius_base_m = round->radius_m.base;
    arm.radius_tip_m = round->radius_m.tip;
    if (own.stiffness) arm.stiffness = Vector6(own.stiffness->diagonal());
    arm.viscosity = own.viscosity;
    arm.inertia = own.inertia;
    return;
  }
  if (arm.pieces.empty()) arm.pieces = {own};
  arm.radius_base_m = AreaOf(arm.pieces.front(), 0.0).radius_m;
  arm.radius_tip_m = AreaOf(arm.pieces.back(), 1.0).radius_m;
}

}  // namespace mantle::model
