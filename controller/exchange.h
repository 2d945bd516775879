#pragma once

#include <array>
#include <atomic>
#include <cstddef>

namespace mantle::controller {

/// The newest of some values from one thread to another, by value: neither waits for the other.
///
/// Three places: one that the writer fills, one that the reader looks at, and one between them that
/// either swaps its own for in one atomic exchange. The reader so always has the newest value that
/// was complete, and keeps it while it likes.
template <typename T>
class Exchange {
 public:
  /// From the writer's thread: hands the value over. Allocates only where sizes grow.
  void Publish(const T& value) {
    places_[static_cast<std::size_t>(writing_)] = value;
    writing_ = between_.exchange(writing_ | kFresh, std::memory_order_acq_rel) & kPlace;
  }
  /// From the reader's thread: the newest value becomes the current one. False where none came
  /// since the last call.
  bool Take() {
    if ((between_.load(std::memory_order_relaxed) & kFresh) == 0) return false;
    reading_ = between_.exchange(reading_, std::memory_order_acq_rel) & kPlace;
    return true;
  }
  /// From the reader's thread: what was taken last; an empty value before that.
  const T& current() const { return places_[static_cast<std::size_t>(reading_)]; }

 private:
  static constexpr int kPlace = 3, kFresh = 4;

  std::array<T, 3> places_;
  int writing_{0}, reading_{1};
  std::atomic<int> between_{2};
};

}  // namespace mantle::controller
