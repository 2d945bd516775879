#include "loop/sensor_channel.h"

#include <gtest/gtest.h>

namespace mantle::loop {
namespace {

Sensors At(double time_s) {
  Sensors message;
  message.time_s = time_s;
  message.has_state = true;
  message.state.q.setConstant(3, time_s);
  message.cables.assign(2, {time_s, -time_s});
  return message;
}

TEST(SensorChannel, GivesMessagesInTheirOrderByValue) {
  SensorChannel channel(3);
  Sensors received;
  EXPECT_FALSE(channel.Receive(&received));
  for (int k = 0; k < 10; ++k) {
    Sensors sent = At(k);
    ASSERT_TRUE(channel.Send(sent));
    ASSERT_TRUE(channel.Send(At(k + 0.5)));
    sent.state.q.setZero();
    ASSERT_TRUE(channel.Receive(&received));
    EXPECT_EQ(received.time_s, k);
    EXPECT_EQ(received.state.q(2), k);
    EXPECT_EQ(received.cables[1].rate_m_s, -k);
    ASSERT_TRUE(channel.Receive(&received));
    EXPECT_EQ(received.time_s, k + 0.5);
    EXPECT_EQ(channel.waiting(), 0U);
  }
}

TEST(SensorChannel, RefusesAndCountsWhatFindsItFull) {
  SensorChannel channel(2);
  EXPECT_TRUE(channel.Send(At(1)));
  EXPECT_TRUE(channel.Send(At(2)));
  EXPECT_FALSE(channel.Send(At(3)));
  EXPECT_EQ(channel.refused(), 1U);
  Sensors received;
  ASSERT_TRUE(channel.Receive(&received));
  EXPECT_EQ(received.time_s, 1) << "what waits is kept";
}

}  // namespace
}  // namespace mantle::loop
