#include "controller/goal_schema.h"

namespace mantle::controller {
namespace {

using schema::kNonNegative;
using schema::kPositive;
using schema::Quantity;
using schema::Range;
using schema::Required;
using schema::Visitor;

constexpr double kSamePlace_m = 1e-6;

void Describe(Visitor& v, CruiseTask& g) {
  v.Direction({"direction", "where to, world"}, &g.direction);
  v.Number({"speed"}, Quantity::kSpeed, kPositive, &g.speed_m_s);
}

void Describe(Visitor& v, const model::Robot& robot, PathTask& g) {
  v.Tables(
      Required(
          {.name = "waypoints", .meaning = "places of the root, in turn", .also = "at least one"}),
      [&](Visitor& t, int) {
        Vector3& at = g.waypoints.emplace_back(Vector3::Zero());
        t.Vector(Required({"at", "in the world"}), Quantity::kLength, schema::kAnyValue, &at);
      });
  v.Demand(!g.waypoints.empty(), "waypoints", "is empty: a path needs at least one waypoint");
  Vector3 before = robot.root_pose.position;
  for (const Vector3& point : g.waypoints) {
    v.Demand((point - before).norm() >= kSamePlace_m, "waypoints",
             "two places in turn are the same");
    before = point;
  }
  v.Number({"speed"}, Quantity::kSpeed, kPositive, &g.speed_m_s);
  v.Number({"ramp", "from rest to `speed`"}, Quantity::kTime, kNonNegative, &g.ramp_s);
  if (robot.body_length_m > 0) g.tolerance_m = 0.05 * robot.body_length_m;
  v.Number({.name = "tolerance",
            .meaning = "a waypoint is passed where the root comes as close",
            .fallback = "5 % of the body"},
           Quantity::kLength, kPositive, &g.tolerance_m);
}

void Describe(Visitor& v, const model::Robot& robot, CircleTask& g) {
  std::vector<std::string> arms;
  for (const model::Arm& arm : robot.arms) arms.push_back(arm.name);
  g.arm = arms.empty() ? -1 : 0;
  v.Reference({.name = "arm", .meaning = "whose tip", .fallback = "the first"}, arms, &g.arm);
  const double length = g.arm < 0 ? 0.0 : robot.arms[g.arm].length_m;
  const Range reach{0, length, true};
  g.radius_m = 0.25 * length;
  g.height_m = 0.95 * length;
  v.Number({.name = "radius", .fallback = "0.25 L", .bound = "(0, L]"}, Quantity::kLength, reach,
           &g.radius_m);
  v.Number({.name = "height",
            .meaning = "of its plane along the arm's base axis",
            .fallback = "0.95 L",
            .bound = "(0, L]"},
           Quantity::kLength, reach, &g.height_m);
  v.Number({"period", "of a turn"}, Quantity::kTime, schema::kTimeStep, &g.period_s);
  v.Number({"approach", "from the axis to the circle"}, Quantity::kTime, kNonNegative,
           &g.approach_s);
}

}  // namespace

void DescribeGoal(Visitor& v, const model::Robot& robot, ControlGoal& goal) {
  enum { kCruise, kPath, kCircle };
  int type = kCruise;
  v.Cases({"type"}, {"cruise", "path", "circle"}, &type, [&](int which) {
    switch (which) {
      case kCruise:
        return Describe(v, goal.emplace<CruiseTask>());
      case kPath:
        return Describe(v, robot, goal.emplace<PathTask>());
      default:
        return Describe(v, robot, goal.emplace<CircleTask>());
    }
  });
}

}  // namespace mantle::controller
