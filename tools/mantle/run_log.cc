#include "tools/mantle/run_log.h"

#include <algorithm>
#include <fstream>
#include <string>
#include <vector>

#include "tools/mantle/bad_input.h"
#include "tools/mantle/loop_telemetry.h"

namespace mantle::tools {

RunLog::RunLog(const model::Plant& plant, int shape_every, std::string_view name)
    : plant_(plant),
      shapes_(plant),
      waters_(plant, shapes_.thinning()),
      shape_every_(shape_every),
      link_(OpenLcm({.log_name = std::string(name)})),
      name_(name) {}

void RunLog::Start(const std::filesystem::path& folder, std::string_view begin,
                   std::int64_t samples) {
  link_->StartLog(folder, begin);
  file_ = folder / name_;
  mark_ = {static_cast<long>(begin.size()), scene::Hash(begin)};
  samples_ = samples;
}

void RunLog::Add(const model::Sample& sample, const model::PlantState& state,
                 const model::EnergyAccount* energy, bool at_end) {
  link_->Write(StateMessage(plant_, sample));
  if (energy != nullptr) link_->Write(EnergyMessage(sample, *energy));
  if (at_end || samples_ % shape_every_ == 0) {
    link_->Write(shapes_.Of(state, sample.cable_tension_n));
    if (waters_.active()) link_->Write(waters_.Of(state));
  }
  ++samples_;
}

RunLog::Mark RunLog::Flush() {
  constexpr std::size_t kBlock_bytes = 1 << 16;
  const long size = link_->FlushLog();
  std::ifstream in(file_, std::ios::binary);
  in.seekg(mark_.bytes);
  std::vector<char> block(kBlock_bytes);
  while (mark_.bytes < size && in) {
    in.read(block.data(), std::min<std::streamsize>(std::ssize(block), size - mark_.bytes));
    mark_.hash = scene::Hash({block.data(), static_cast<std::size_t>(in.gcount())}, mark_.hash);
    mark_.bytes += static_cast<long>(in.gcount());
  }
  if (mark_.bytes != size) {
    throw CannotGoOn(file_.string() + ": cannot be read back: has something else changed it?");
  }
  return mark_;
}

void RunLog::Close() { link_->FinishLog(); }

}  // namespace mantle::tools
