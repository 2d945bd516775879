#pragma once

#include "controller/options.h"
#include "loop/options.h"
#include "loop/scene/toml_reader.h"
#include "model/robot.h"
#include "reduced/reduction.h"

/// The parts of a scene, each read from its table. Internal to the scene reader. All throw
/// BadScene.

namespace mantle::scene {

using namespace controller;
using namespace model;
using namespace reduced;
using loop::DriveOptions;
using loop::Mismatch;

/// A schedule whose values are `quantity`: a constant (number or text with unit), or a table with
/// `type`. Values of constants, waves and tables must lie in `range`. Throws where the key is
/// absent.
Schedule ReadSchedule(TomlReader* parent, std::string_view key, Quantity quantity, Range range);
std::optional<Schedule> ReadOptionalSchedule(TomlReader* parent, std::string_view key,
                                             Quantity quantity, Range range);

/// `tension` or `reel` of a cable's table, exactly one of them.
CableDrive ReadCableDrive(TomlReader* cable);

/// Keys `position`, and one of `axis` (with `normal`), `rotation`, `matrix`, of a pose's table.
Pose ReadPose(TomlReader table);

/// Keys `angular` and `linear`.
Vector6 ReadTwist(TomlReader table);

Material ReadMaterialTable(TomlReader table);
/// A material's table, or the name of an entry of [materials].
Material ReadMaterial(TomlReader* parent, std::string_view key);

Arm ReadArm(TomlReader table, int index);
Mantle ReadMantle(TomlReader table);
/// Start and pieces of the meridian from the mantle's key `shape`, and z of X = 0 from `position`.
void ReadMantleShape(TomlReader* mantle, Mantle* out);
RigidBody ReadRigidBody(TomlReader table);
Effects ReadEffects(TomlReader table);

/// The table [reduced]; names of arms, cables, loads and strips are those of `robot`.
Reduction ReadReduction(TomlReader table, const Robot& robot);
/// One actuator per cable of the robot, named ARM.CABLE, in the plant's order.
std::vector<Actuator> CableActuators(const Robot& robot);

/// The tables [control], [drives], [sensors], [mismatch]; `motors` are those of [reduced].
ControlOptions ReadControl(TomlReader table, const Robot& robot,
                           const std::vector<Actuator>& motors);
DriveOptions ReadDrives(TomlReader table);
SensorOptions ReadSensors(TomlReader table);
Mismatch ReadMismatch(TomlReader table);

/// Refuses effects, couplings and names that contradict each other or the bodies.
void CheckScene(const Robot& robot, bool gravity_given, const SceneContext& context);

}  // namespace mantle::scene
