#include "controller/plan_buffer.h"

#include <gtest/gtest.h>

#include <atomic>
#include <thread>

namespace mantle::controller {
namespace {

/// A plan all of whose numbers are `mark`.
IssuedPlan Marked(double mark) {
  IssuedPlan issued;
  issued.plan.time_s.assign(20, mark);
  issued.plan.tensions.setConstant(5, 20, mark);
  issued.plan.gains.assign(4, Eigen::MatrixXd::Constant(5, 40, mark));
  issued.issued_s = mark;
  issued.tensions_n.setConstant(5, mark);
  return issued;
}

/// Of one piece: no number of another plan is in it.
bool IsWhole(const IssuedPlan& issued) {
  const double mark = issued.issued_s;
  bool whole =
      (issued.plan.tensions.array() == mark).all() && (issued.tensions_n.array() == mark).all();
  for (const double t : issued.plan.time_s) whole = whole && t == mark;
  for (const auto& gain : issued.plan.gains) whole = whole && (gain.array() == mark).all();
  return whole;
}

TEST(PlanBuffer, GivesTheNewestPlanOnceAndKeepsIt) {
  PlanBuffer buffer;
  EXPECT_FALSE(buffer.Take());
  EXPECT_TRUE(buffer.current().plan.empty());
  buffer.Publish(Marked(1));
  buffer.Publish(Marked(2));
  ASSERT_TRUE(buffer.Take());
  EXPECT_EQ(buffer.current().issued_s, 2);
  EXPECT_FALSE(buffer.Take());
  EXPECT_EQ(buffer.current().issued_s, 2);
  buffer.Publish(Marked(3));
  EXPECT_EQ(buffer.current().issued_s, 2) << "current until it is exchanged";
  ASSERT_TRUE(buffer.Take());
  EXPECT_EQ(buffer.current().issued_s, 3);
}

TEST(PlanBuffer, HandsOverByValue) {
  PlanBuffer buffer;
  IssuedPlan mine = Marked(1);
  buffer.Publish(mine);
  mine = Marked(2);
  ASSERT_TRUE(buffer.Take());
  EXPECT_TRUE(IsWhole(buffer.current()));
  EXPECT_EQ(buffer.current().issued_s, 1);
}

TEST(PlanBuffer, TwoThreadsSeeWholePlansInTheirOrderAndTheLastOne) {
  constexpr int kPlans = 2000;
  PlanBuffer buffer;
  std::atomic<bool> done{false};
  std::thread planner([&] {
    for (int i = 1; i <= kPlans; ++i) buffer.Publish(Marked(i));
    done = true;
  });
  double newest = 0;
  bool in_order = true, whole = true;
  while (!done) {
    if (!buffer.Take()) continue;
    in_order = in_order && buffer.current().issued_s > newest;
    whole = whole && IsWhole(buffer.current());
    newest = buffer.current().issued_s;
  }
  planner.join();
  if (buffer.Take()) newest = buffer.current().issued_s;
  EXPECT_TRUE(in_order);
  EXPECT_TRUE(whole);
  EXPECT_EQ(newest, kPlans);
}

}  // namespace
}  // namespace mantle::controller
