#include <fmt/format.h>

#include <cstdint>
#include <cstring>
#include <sstream>
#include <type_traits>

#include "model/simulation.h"

/// Checkpoints are text: a header that names the robot and its sizes, then every number as the
/// hexadecimal of its bits, so that a resumed run continues with the same bits.

namespace mantle::model {
namespace {

constexpr const char* kMagic = "mantle-checkpoint-6";

class Writer {
 public:
  void Put(double x) {
    std::uint64_t bits;
    std::memcpy(&bits, &x, sizeof bits);
    text += fmt::format("{:016x}\n", bits);
  }
  std::string text;
};

class Reader {
 public:
  explicit Reader(const std::string& text) : in_(text) {}
  double Get() {
    std::string word;
    if (!(in_ >> word) || word.size() != 16) throw BadRobot("checkpoint: is cut short or damaged");
    std::uint64_t bits = 0;
    for (char c : word) {
      const char* digits = "0123456789abcdef";
      const char* at = std::strchr(digits, c);
      if (at == nullptr) throw BadRobot("checkpoint: is damaged");
      bits = bits << 4 | static_cast<std::uint64_t>(at - digits);
    }
    double x;
    std::memcpy(&x, &bits, sizeof x);
    return x;
  }
  std::istringstream& stream() { return in_; }

 private:
  std::istringstream in_;
};

// The same walk over every number for saving and restoring.
template <typename Number>
void Walk(PlantState* state, Number number) {
  number(state->time_s);
  for (Pose& p : state->pose) {
    for (double& x : p.rotation.coeffs()) number(x);
    for (double& x : p.position) number(x);
  }
  for (Vector3& q : state->shape) {
    for (double& x : q) number(x);
  }
  for (double& v : state->velocity) number(v);
}

std::string Header(const Plant& plant, std::size_t works) {
  return fmt::format("{} poses {} shape {} velocity {} works {}\n", kMagic, plant.pose_count(),
                     plant.shape_count(), plant.velocity_size(), works);
}

}  // namespace

std::string Simulation::Checkpoint() const {
  Writer out;
  out.text = Header(plant_, energy_.names().size());
  PlantState state = state_;
  Walk(&state, [&](double& x) { out.Put(x); });
  StepCap step_cap = step_cap_;
  step_cap.Walk([&](double& x) { out.Put(x); });
  StepControl step_control = step_control_;
  step_control.Walk([&](double& x) { out.Put(x); });
  for (double w : energy_.work_j()) out.Put(w);
  out.Put(energy_.dissipated_j());
  const StepCounters c = counters();
  for (long n : {c.steps, c.rejected, c.newton_iterations, c.factorisations, c.evaluations}) {
    out.Put(static_cast<double>(n));
  }
  static_assert(sizeof(Account) % sizeof(double) == 0 && std::is_trivially_copyable_v<Account>);
  double account[sizeof(Account) / sizeof(double)];
  std::memcpy(account, &account_, sizeof account);
  for (double x : account) out.Put(x);
  out.Put(static_cast<double>(drops_.size()));
  for (const PayloadDrop& drop : drops_) {
    out.Put(drop.payload);
    out.Put(drop.time_s);
    for (const Vector3& v : {drop.centre_m, drop.velocity_m_s, drop.momentum_kg_m_s}) {
      for (double x : v) out.Put(x);
    }
    out.Put(drop.kinetic_energy_j);
  }
  return out.text + stepper_->SaveMemory();
}

void Simulation::Restore(const std::string& checkpoint) {
  const std::string header = Header(plant_, energy_.names().size());
  if (checkpoint.compare(0, header.size(), header) != 0) {
    throw BadRobot(fmt::format("checkpoint: is \"{}\", this scene needs \"{}\"",
                               checkpoint.substr(0, std::min(checkpoint.find('\n'), header.size())),
                               header.substr(0, header.size() - 1)));
  }
  Reader in(checkpoint.substr(header.size()));
  PlantState state = state_;
  Walk(&state, [&](double& x) { x = in.Get(); });
  StepCap step_cap = step_cap_;
  step_cap.Walk([&](double& x) { x = in.Get(); });
  StepControl step_control = step_control_;
  step_control.Walk([&](double& x) { x = in.Get(); });
  std::vector<double> works(energy_.names().size());
  for (double& w : works) w = in.Get();
  const double dissipated = in.Get();
  StepCounters c;
  for (long* n : {&c.steps, &c.rejected, &c.newton_iterations, &c.factorisations, &c.evaluations}) {
    *n = static_cast<long>(in.Get());
  }
  double account[sizeof(Account) / sizeof(double)];
  for (double& x : account) x = in.Get();
  const double count = in.Get();
  if (!(count >= 0.0 && count <= static_cast<double>(work_.payloads.size()))) {
    throw BadRobot("checkpoint: is damaged");
  }
  std::vector<PayloadDrop> drops(static_cast<std::size_t>(count));
  for (PayloadDrop& drop : drops) {
    drop.payload = static_cast<int>(in.Get());
    drop.name = PayloadName(plant_, drop.payload);
    drop.time_s = in.Get();
    for (Vector3* v : {&drop.centre_m, &drop.velocity_m_s, &drop.momentum_kg_m_s}) {
      for (double& x : *v) x = in.Get();
    }
    drop.kinetic_energy_j = in.Get();
  }
  std::string memory, word;
  while (in.stream() >> word) memory += word + " ";
  stepper_ = MakeStepper(plant_, settings_.stepper);
  stepper_->RestoreMemory(memory);
  const StepCounters fresh = stepper_->counters();
  state_ = state;
  drops_ = drops;
  step_cap_ = step_cap;
  step_control_ = step_control;
  energy_.Restore(works, dissipated);
  std::memcpy(&account_, account, sizeof account);
  before_resume_ = c;
  before_resume_.factorisations -= fresh.factorisations;
}

}  // namespace mantle::model
