#pragma once

#include <atomic>
#include <cstddef>
#include <vector>

namespace mantle::firmware_sim {

/// First-in-first-out queue between two threads, one that pushes and one that pops: neither waits
/// for the other. Values are copied into places that exist from the beginning; a push allocates
/// only where a value is larger than those that its place has held.
template <typename T>
class SpscRing {
 public:
  /// `capacity` values wait at most, 1 or more. `example` sizes the places.
  explicit SpscRing(std::size_t capacity, const T& example = T{})
      : places_(capacity + 1, example) {}

  /// From the one thread. False, and nothing changes, where the queue is full.
  bool Push(const T& value) {
    const std::size_t at = last_.load(std::memory_order_relaxed), next = After(at);
    if (next == first_.load(std::memory_order_acquire)) return false;
    places_[at] = value;
    last_.store(next, std::memory_order_release);
    return true;
  }

  // From the other thread.

  /// The oldest value, valid until Drop; null where there is none.
  const T* Front() const {
    const std::size_t at = first_.load(std::memory_order_relaxed);
    return at == last_.load(std::memory_order_acquire) ? nullptr : &places_[at];
  }
  /// Precondition: there is one.
  void Drop() {
    first_.store(After(first_.load(std::memory_order_relaxed)), std::memory_order_release);
  }
  /// False where there is none.
  bool Pop(T* value) {
    const T* front = Front();
    if (front == nullptr) return false;
    *value = *front;
    Drop();
    return true;
  }

  /// Values that wait; of the past as soon as it is known, where the other thread goes on.
  std::size_t size() const {
    const std::size_t first = first_.load(std::memory_order_acquire);
    const std::size_t last = last_.load(std::memory_order_acquire);
    return (last + places_.size() - first) % places_.size();
  }

 private:
  std::size_t After(std::size_t at) const { return at + 1 == places_.size() ? 0 : at + 1; }

  std::vector<T> places_;
  alignas(64) std::atomic<std::size_t> first_{0};
  alignas(64) std::atomic<std::size_t> last_{0};
};

}  // namespace mantle::firmware_sim
