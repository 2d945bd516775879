#pragma once

#include "model/robot.h"
#include "model/schema.h"

/// @file
/// The keys of a robot: its root, bodies, materials, loads and effects.

namespace mantle::model {

/// Most elements a body may have; beyond, a slip of the pen is more likely than a wish.
inline constexpr int kMaxElements = 100000;

/// A number (constant), or a table with `type`. `range` bounds values of constants, waves and
/// tables, not those of a sine. Returns whether the key is given.
bool DescribeSchedule(schema::Visitor& v, const schema::Key& key, schema::Quantity quantity,
                      schema::Range range, Schedule* schedule);
bool DescribeSchedule(schema::Visitor& v, const schema::Key& key, schema::Quantity quantity,
                      schema::Range range, std::optional<Schedule>* schedule);

/// Keys `tension` and `reel` of a cable, exactly one of them.
void Describe(schema::Visitor& v, CableDrive& drive);

/// Keys `position`, and one of `axis` (with `normal`), `rotation`, `matrix`.
void Describe(schema::Visitor& v, Pose& pose);
/// Keys `angular` and `linear`.
void DescribeTwist(schema::Visitor& v, Vector6& twist);
void Describe(schema::Visitor& v, Material& material);
/// A material's table, or the name of an entry of [materials].
bool DescribeMaterial(schema::Visitor& v, const schema::Key& key, Material* material);

void Describe(schema::Visitor& v, Water& water);
/// Keys of an arm's sections, `length_m` known: outline, material or matrices; or `radius_profile`,
/// or `pieces`.
void DescribeSections(schema::Visitor& v, Arm& arm);
/// `index` counts arms from 0, for their default names.
void DescribeArm(schema::Visitor& v, int index, Arm& arm);
void Describe(schema::Visitor& v, Mantle& mantle);
void Describe(schema::Visitor& v, RigidBody& body);
void Describe(schema::Visitor& v, Effects& effects);
/// Table [mismatch]; not part of Describe(Robot).
void Describe(schema::Visitor& v, Mismatch& mismatch);
/// Table [robot]: motion and place of the root.
void DescribeRoot(schema::Visitor& v, Robot& robot);

/// Tables of a scene that make a robot: [water], [materials], [robot], [[arms]], [mantle],
/// [rigid_body] and [effects]; refuses effects, couplings and names that contradict each other or
/// the bodies.
void Describe(schema::Visitor& v, Robot& robot);

}  // namespace mantle::model
