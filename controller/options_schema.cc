#include "controller/options_schema.h"

#include <algorithm>
#include <cmath>

#include "controller/goal_schema.h"
#include "controller/registry.h"

namespace mantle::controller {

using schema::kAnyValue;
using schema::kNonNegative;
using schema::kPositive;
using schema::kShare;
using schema::Optional;
using schema::Quantity;
using schema::Range;
using schema::Required;
using schema::Visitor;

// Of a scene's filter: S takes for white what lasts in a model's errors. A fast start with a model
// that is trusted comes to sixty deviations, five units on every shape coordinate to thousands.
constexpr double kSceneGate = 100;

static void Describe(Visitor& v, ControlGrid& g) {
  v.Integer({"steps"}, 1, 200, &g.steps);
  v.Number({"step", "the first"}, Quantity::kTime, schema::kTimeStep, &g.step_s);
  v.Number({"growth", "of each step over the one before"}, Quantity::kNumber, Range{1, 2},
           &g.growth);
  std::vector<double> knots;
  v.Numbers(Optional({.name = "knots",
                      .meaning = "nodes whose tensions are decided",
                      .fallback = "eight",
                      .bound = "ascending, last one `steps`"}),
            Quantity::kNumber, Range{1, double(g.steps)}, schema::kOneOrMore, &knots);
  int before = 0;
  for (const double k : knots) {
    v.Demand(k == std::floor(k) && k > before, "knots", "must be whole numbers that ascend");
    before = static_cast<int>(k);
    g.knots.push_back(before);
  }
  v.Demand(knots.empty() || before == g.steps, "knots", "must end with the last node, `steps`");
}

static void Describe(Visitor& v, MotorLimits& m) {
  std::vector<double> tension = {m.min_tension_n, m.max_tension_n};
  v.Numbers({"tension", "hard"}, Quantity::kForce, kNonNegative, 2, &tension);
  v.Demand(tension[0] <= tension[1], "tension", "the upper limit lies below the lower one");
  m.min_tension_n = tension[0];
  m.max_tension_n = tension[1];
  v.Number({.name = "rate", .meaning = "hard", .unit = "N/s"}, Quantity::kNumber, kPositive,
           &m.max_rate_n_s);
  v.Choice<bool>({"decides",
                  "where tensions are decided: at the grid's knots, or at every node, as the form "
                  "of a pulse needs"},
                 {{"knots", false}, {"nodes", true}}, &m.decides_every_node);
}

static void Describe(Visitor& v, CostWeights& c) {
  const auto weight = [&](std::string_view name, std::string_view unit, std::string_view meaning,
                          double* value) {
    v.Number({.name = name, .meaning = meaning, .unit = unit}, Quantity::kNumber, kNonNegative,
             value);
  };
  weight("position", "1/m^2", "distance of the root from the reference, squared (path)",
         &c.position);
  weight("heading", "", "difference of e3 from the reference's direction, squared", &c.heading);
  weight("velocity", "s^2/m^2", "of the root, against the reference's", &c.velocity);
  weight("mean_velocity", "s^2/m^2", "the same, averaged over the gait's period", &c.mean_velocity);
  weight("turn_rate", "s^2", "", &c.turn_rate);
  weight("tip", "1/m^2", "circle", &c.tip);
  weight("volume", "", "(U / U_0 - 1)^2", &c.volume);
  weight("effort", "1/N^2", "sum of squares of the tensions", &c.effort);
  weight("rate", "s^2/N^2", "of their rates", &c.rate);
  weight("terminal", "s", "multiplies the state's part at the end of the horizon", &c.terminal);
}

static void Describe(Visitor& v, SoftBound& b) {
  using Q = SoftBound::Quantity;
  v.Choice<Q>({"quantity", "U / U_0; m/s; rad/s; 1/m of every segment"},
              {{"volume", Q::kVolume},
               {"speed", Q::kSpeed},
               {"turn_rate", Q::kTurnRate},
               {"curvature", Q::kCurvature}},
              &b.quantity);
  b.low = -std::numeric_limits<double>::infinity();
  b.high = std::numeric_limits<double>::infinity();
  v.Number(Optional({"low"}), Quantity::kNumber, kAnyValue, &b.low);
  v.Number(Optional({.name = "high", .also = ">= `low`"}), Quantity::kNumber, kAnyValue, &b.high);
  v.Demand(b.low <= b.high, "high", "lies below `low`");
  v.Number(Required({"weight"}), Quantity::kNumber, kPositive, &b.weight);
}

static void DescribePulse(Visitor& v, const MotorLimits& limits, GaitPulse& p) {
  const Range range{limits.min_tension_n, limits.max_tension_n};
  constexpr std::string_view kWithin = "within the motor's limits";
  v.Number({.name = "low", .fallback = "lower limit", .bound = kWithin}, Quantity::kForce, range,
           &p.low_n);
  p.high_n = p.low_n;
  v.Number({.name = "high", .fallback = "`low`", .bound = kWithin}, Quantity::kForce, range,
           &p.high_n);
  v.Number({"rise", "share of the period"}, Quantity::kNumber, kShare, &p.rise);
  v.Number({"hold"}, Quantity::kNumber, kShare, &p.hold);
  v.Number({.name = "fall", .also = "rise + hold + fall <= 1"}, Quantity::kNumber, kShare, &p.fall);
  v.Number({"phase", "where the pulse begins"}, Quantity::kNumber, kShare, &p.phase);
  v.Demand(p.rise + p.hold + p.fall <= 1 + 1e-12, "fall", "rise + hold + fall exceed 1");
}

static void DescribeGait(Visitor& v, const std::vector<std::string>& motors,
                         const std::vector<MotorLimits>& limits, Gait& gait) {
  v.Number({"period"}, Quantity::kTime, schema::kTimeStep, &gait.period_s);
  for (const MotorLimits& m : limits) {
    gait.motors.push_back({m.min_tension_n, m.min_tension_n, 0.5, 0, 0.5, 0});
  }
  v.Tables(Optional({"pulses", "of one motor each; the others rest at their lower limit"}),
           [&](Visitor& t, int) {
             int motor = -1;
             t.Reference(Required({"motor", "a motor"}), motors, &motor);
             GaitPulse unnamed;
             DescribePulse(t, motor < 0 ? MotorLimits{} : limits[motor],
                           motor < 0 ? unnamed : gait.motors[motor]);
           });
}

static void Describe(Visitor& v, BaselineGains& g) {
  v.Number({"gait_scale", "of the gait's tensions"}, Quantity::kNumber, kNonNegative,
           &g.gait_scale);
  v.Number({"gait_period", "of its period"}, Quantity::kNumber, kPositive, &g.gait_period);
  v.Number({"gait_lead", "by which it acts earlier"}, Quantity::kTime, kNonNegative,
           &g.gait_lead_s);
  v.Number({.name = "proportional", .meaning = "pursuit, PID", .unit = "N/rad, N/m"},
           Quantity::kNumber, kAnyValue, &g.proportional);
  v.Number({.name = "integral", .meaning = "PID", .unit = "N/(rad s), N/(m s)"}, Quantity::kNumber,
           kAnyValue, &g.integral);
  v.Number({.name = "derivative", .meaning = "pursuit, PID", .unit = "N s/rad, N s/m"},
           Quantity::kNumber, kAnyValue, &g.derivative);
  v.Number({"lookahead", "along the reference"}, Quantity::kTime, kNonNegative, &g.lookahead_s);
  v.Number({"effort", "LQR: weights of effort and rate over the cost's"}, Quantity::kNumber,
           kPositive, &g.lqr_effort);
  v.Number(
      {.name = "speed_gain",
       .meaning = "of the gait's scale, by the along-track error (cruise: by the mean speed's)",
       .unit = "1/m, s/m"},
      Quantity::kNumber, kAnyValue, &g.speed_gain);
}

static void Describe(Visitor& v, EstimatorOptions& e) {
  schema::PickName(v, {"type", "or the name of one that a program has registered"},
                   EstimatorNames(), &e.type);
  v.Boolean({"observer",
             "the state is what the filter makes of all measurements, whose deviations it takes "
             "from `[sensors]`; else the newest one"},
            &e.observer);
  v.Boolean({"disturbance",
             "the filter finds a bias of every tension and an acceleration of a free root"},
            &e.disturbance);
  v.Number({"model_noise", "factor on the filter's distrust of the model"}, Quantity::kNumber,
           kPositive, &e.model_noise);
  v.Number({.name = "tension_walk",
            .meaning = "how far a bias wanders in a second",
            .unit = "N/s^(1/2)"},
           Quantity::kNumber, kNonNegative, &e.tension_walk_n);
  v.Number(
      {.name = "acceleration_walk", .meaning = "the same of the acceleration", .unit = "m/s^(5/2)"},
      Quantity::kNumber, kNonNegative, &e.acceleration_walk_m_s2);
  v.Boolean({.name = "current",
             .meaning = "the filter finds the velocity of the water, taken as uniform and steady",
             .fallback = "whether `effects.current` is given"},
            &e.current);
  v.Number(
      {.name = "current_walk", .meaning = "how far that wanders in a second", .unit = "m/s^(3/2)"},
      Quantity::kNumber, kNonNegative, &e.current_walk_m_s);
  v.Number({"gate",
            "a measurement further from what the filter expects than a normal distribution's at so "
            "many standard deviations is refused, ten in turn at most; 0: none is"},
           Quantity::kNumber, kNonNegative, &e.gate);
}

static void DescribeMotors(Visitor& v, const std::vector<std::string>& motors, ControlOptions& c) {
  MotorLimits all;
  v.Object({"limits", "of every motor"}, &all);
  c.motors.assign(motors.size(), all);
  v.Tables(Optional({"motors", "limits of one motor; what it does not say is as for every motor"}),
           [&](Visitor& t, int) {
             int motor = -1;
             t.Reference(Required({"name", "a motor"}), motors, &motor);
             Describe(t, motor < 0 ? all : c.motors[motor]);
           });
}

void Describe(Visitor& v, const model::Robot& robot, const std::vector<reduced::Actuator>& motors,
              ControlOptions& c) {
  std::vector<std::string> names;
  for (const reduced::Actuator& motor : motors) names.push_back(motor.name);
  schema::PickName(v, {"controller", "or the name of one that a program has registered"},
                   ControllerNames(), &c.controller);
  v.Choice<MpcMode>({"mode", "one linearisation per period, or until the plan stands still"},
                    {{"rti", MpcMode::kRealTimeIteration}, {"converged", MpcMode::kConverged}},
                    &c.mode);
  v.Table(Required({"goal", "what is commanded"}),
          [&](Visitor& t) { DescribeGoal(t, robot, c.goal); });
  v.Object({"grid", "the horizon"}, &c.grid);
  c.period_s = c.grid.step_s;
  v.Number({.name = "period",
            .meaning = "between plans",
            .fallback = "`grid.step`",
            .also = "multiple of `drives.period`"},
           Quantity::kTime, schema::kTimeStep, &c.period_s);
  v.Number({.name = "delay",
            .meaning = "from a measurement until its plan acts",
            .bound = "[0, `grid.steps` x `grid.step`]"},
           Quantity::kTime, Range{0, c.grid.steps * c.grid.step_s}, &c.delay_s);
  v.Number({"deadline", "of the solver, in real time"}, Quantity::kTime, kPositive, &c.deadline_s);
  v.Choice<SolverMethod>(
      {"solver",
       "`active_set`: a dual active-set method; `ipopt`: Ipopt, whose active set is then "
       "made exact. Either solves to round-off"},
      {{"active_set", SolverMethod::kActiveSet}, {"ipopt", SolverMethod::kInteriorPoint}},
      &c.solver);
  v.Integer({"iterations", "of the solver, always"}, 1, 10000, &c.max_iterations);
  v.Number({.name = "levenberg",
            .meaning = "damping of a change of the plan: weight of the time integral of its "
                       "square, as a share of the cost's mean curvature along it"},
           Quantity::kNumber, kNonNegative, &c.levenberg);
  DescribeMotors(v, names, c);
  v.Object({"cost", "weights of the stage cost, per second"}, &c.cost);
  v.Tables(Optional({"bounds", "soft bounds: weight times the square of what is outside"}),
           [&](Visitor& t, int) { Describe(t, c.bounds.emplace_back()); });
  for (const SoftBound& b : c.bounds) {
    v.Demand(b.quantity != SoftBound::Quantity::kVolume || robot.mantle, "bounds",
             "bounds the volume of a robot without a mantle");
  }
  v.Table({"gait", "periodic tensions: seed of the plans, and a baseline"},
          [&](Visitor& t) { DescribeGait(t, names, c.motors, c.gait); });
  v.Table({"baselines", "gains of the baselines, as `mantle tune` finds them"}, [&](Visitor& t) {
    const schema::Key keys[] = {{"gait", "of the open-loop gait"},
                                {"pursuit", "of pursuit"},
                                {"pid", "of the PID"},
                                {"lqr", "of the LQR"}};
    for (std::size_t i = 0; i < 4; ++i) {
      schema::Key key = keys[i];
      key.type = "gains";
      t.Object(key, &c.baselines[i]);
    }
  });
  c.estimator.current = robot.effects.current_m_s || robot.effects.unsteady_current;
  c.estimator.gate = kSceneGate;
  v.Object({"estimator", "what makes the state of measurements"}, &c.estimator);
}

void Describe(Visitor& v, SensorOptions& s) {
  const auto deviation = [&](const schema::Key& key, Quantity quantity, double* value) {
    v.Number(key, quantity, kNonNegative, value);
  };
  deviation({"position", "of the root"}, Quantity::kLength, &s.position_m);
  deviation({"attitude"}, Quantity::kAngle, &s.attitude_rad);
  deviation({"velocity"}, Quantity::kSpeed, &s.velocity_m_s);
  deviation({"angular_velocity"}, Quantity::kAngularSpeed, &s.angular_velocity_rad_s);
  deviation({"strain", "of the arms' strain coordinates"}, Quantity::kCurvature, &s.strain);
  deviation({.name = "strain_rate", .unit = "1/(m s)"}, Quantity::kNumber, &s.strain_rate);
  deviation({"mantle", "shares of the mantle's coordinates"}, Quantity::kNumber, &s.mantle);
  deviation({.name = "mantle_rate", .unit = "1/s"}, Quantity::kNumber, &s.mantle_rate);
  deviation({"cable", "of cable lengths"}, Quantity::kLength, &s.cable_m);
  deviation({"cable_rate"}, Quantity::kSpeed, &s.cable_rate_m_s);
  deviation({"bias", "of a constant bias, over the noise's"}, Quantity::kNumber, &s.bias);
  deviation({"delay", "of every measurement"}, Quantity::kTime, &s.delay_s);
  v.Number({"loss", "probability that a measurement is lost"}, Quantity::kNumber, Range{0, 0.99},
           &s.loss);
  v.Integer({"seed"}, 0, 1000000000, &s.seed);
}

}  // namespace mantle::controller
