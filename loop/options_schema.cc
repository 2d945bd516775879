#include "loop/options_schema.h"

#include <cmath>

#include "loop/drive_options.h"
#include "loop/vehicle_side.h"

namespace mantle::loop {

using schema::Quantity;
using schema::Range;
using schema::Visitor;

static Range Between(const double (&bounds)[2]) { return {bounds[0], bounds[1]}; }

void Describe(Visitor& v, DriveOptions& d) {
  schema::PickName(
      v, {"vehicle", "the scene's plant, or the name of one that a program has registered"},
      VehicleNames(), &d.vehicle);
  v.Text({.name = "bus", .bound = "`loop`, `can:NAME`, `udp:GROUP:PORT[@IFACE]`"}, &d.bus);
  v.Number({.name = "period", .meaning = "of SYNC", .also = "whole ms"}, Quantity::kTime,
           Between(drive_bounds::kPeriod_s), &d.period_s);
  v.Demand(std::abs(1e3 * d.period_s - std::round(1e3 * d.period_s)) <= 1e-6, "period",
           "must be whole milliseconds");
  v.Number({"cable_stiffness", "of a motor's cable, at the drum"}, Quantity::kStiffness,
           Between(drive_bounds::kCableStiffness_n_m), &d.cable_stiffness_n_m);
  v.Number({"cable_damping"}, Quantity::kDamping, Between(drive_bounds::kCableDamping_n_s_m),
           &d.cable_damping_n_s_m);
  v.Number({"pretension", "taken up before t = 0"}, Quantity::kForce,
           Between(drive_bounds::kPretension_n), &d.pretension_n);
}

}  // namespace mantle::loop
