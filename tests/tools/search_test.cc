#include "tools/studies/search.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace mantle::tools {
namespace {

constexpr SearchMethod kMethods[] = {SearchMethod::kSubplex, SearchMethod::kBobyqa,
                                     SearchMethod::kCrs};

// A bent valley inside the box, least (zero) at (0.7, 0.4, 0.2).
double Valley(const std::vector<double>& x) {
  const double a = x[0] - 0.7, b = x[1] - 0.4 - a * a, c = x[2] - 0.2;
  return a * a + 20 * b * b + 3 * c * c + a * c;
}

const std::function<bool()> kGoOn = [] { return false; };

TEST(Search, EveryMethodFindsAValleysBottom) {
  for (const SearchMethod method : kMethods) {
    const SearchResult r = Minimise(method, {0.2, 0.8, 0.9}, 0.15, 600, Valley, kGoOn);
    // Searches end at steps of 2e-3 of the box; the valley's curvature is 20 at most.
    constexpr double kEnd = 1e-3;
    EXPECT_LT(r.value, kEnd) << kSearchMethods[static_cast<int>(method)];
    EXPECT_EQ(r.value, Valley(r.x));
  }
}

TEST(Search, SpendsNoMoreThanItsBudgetAndStaysInTheBox) {
  for (const SearchMethod method : kMethods) {
    for (const int budget : {1, 7, 40}) {
      int calls = 0;
      const SearchResult r = Minimise(
          method, {0.0, 1.0, 0.5}, 0.15, budget,
          [&](const std::vector<double>& x) {
            ++calls;
            for (const double v : x) EXPECT_TRUE(v >= 0 && v <= 1) << v;
            return -x[0];  // least on the box's face
          },
          kGoOn);
      EXPECT_LE(calls, budget);
      EXPECT_EQ(r.evaluations, calls);
    }
  }
}

TEST(Search, TheSameSearchGivesTheSameBits) {
  for (const SearchMethod method : kMethods) {
    const SearchResult a = Minimise(method, {0.2, 0.8, 0.9}, 0.15, 60, Valley, kGoOn);
    const SearchResult b = Minimise(method, {0.2, 0.8, 0.9}, 0.15, 60, Valley, kGoOn);
    EXPECT_EQ(a.x, b.x);
    EXPECT_EQ(a.evaluations, b.evaluations);
  }
}

TEST(Search, PlateausOfFailuresDoNotTrapIt) {
  // Runs that fail cost a million: half of the box.
  const auto cost = [](const std::vector<double>& x) { return x[0] > 0.75 ? 1e6 : Valley(x); };
  for (const SearchMethod method : {SearchMethod::kSubplex, SearchMethod::kCrs}) {
    const SearchResult r = Minimise(method, {0.2, 0.8, 0.9}, 0.15, 600, cost, kGoOn);
    constexpr double kEnd = 2e-2;
    EXPECT_LT(r.value, kEnd) << kSearchMethods[static_cast<int>(method)];
  }
}

TEST(Search, StopsWhenToldAndThrowsOnWhatTheObjectiveThrows) {
  for (const SearchMethod method : kMethods) {
    int calls = 0;
    const auto count = [&](const std::vector<double>& x) {
      ++calls;
      return Valley(x);
    };
    Minimise(method, {0.2, 0.8, 0.9}, 0.15, 100, count, [&] { return calls >= 5; });
    EXPECT_EQ(calls, 5);
    const auto broken = [](const std::vector<double>&) -> double {
      throw std::runtime_error("broken");
    };
    EXPECT_THROW(Minimise(method, {0.2, 0.8, 0.9}, 0.15, 100, broken, kGoOn), std::runtime_error);
  }
}

}  // namespace
}  // namespace mantle::tools
