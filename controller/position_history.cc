#include "controller/position_history.h"

#include <algorithm>

namespace mantle::controller {

void PositionHistory::Reset(double t_s, const Vector3& position) {
  entries_.clear();
  entries_.reserve(4096);
  entries_.push_back({t_s, position});
}

void PositionHistory::Add(double t_s, const Vector3& position) {
  if (!entries_.empty() && t_s <= entries_.back().time_s) return;
  entries_.push_back({t_s, position});
  std::size_t old = 0;
  while (old + 1 < entries_.size() && entries_[old + 1].time_s < t_s - length_s_) ++old;
  entries_.erase(entries_.begin(), entries_.begin() + static_cast<std::ptrdiff_t>(old));
}

Vector3 PositionHistory::At(double t_s) const {
  if (entries_.empty()) return Vector3::Zero();
  if (t_s <= entries_.front().time_s) return entries_.front().position;
  const auto after =
      std::upper_bound(entries_.begin(), entries_.end(), t_s,
                       [](double t, const Entry& entry) { return t < entry.time_s; });
  if (after == entries_.end()) return entries_.back().position;
  const Entry &a = *(after - 1), &b = *after;
  return a.position + (t_s - a.time_s) / (b.time_s - a.time_s) * (b.position - a.position);
}

}  // namespace mantle::controller
