#include "tools/live/live_feed.h"

#include <gtest/gtest.h>

#include <atomic>
#include <limits>
#include <nlohmann/json.hpp>
#include <thread>

#include "tests/tools/telemetry_samples.h"

namespace mantle::testing_tools {
namespace {

using namespace tools;
using namespace std::chrono_literals;

// Messages of sample k of a small robot, consistent in themselves.
Messages Sample(int k) {
  Messages m = OctopusMessages(k);
  m.shape.arm_nodes.assign(kArms, static_cast<std::int32_t>(kNodes / kArms));
  m.shape.cable_points.assign(kCables, 1);
  m.shape.cable_position.resize(kCables);
  return m;
}

const Json kServer = {{"viewers", 0}};

// The data of events of this name in a text.
std::vector<Json> Events(const LiveFeed::Text& text, const std::string& name) {
  std::vector<Json> found;
  if (text == nullptr) return found;
  const std::string head = "event: " + name + "\ndata: ";
  for (std::size_t at = text->find(head); at != text->npos; at = text->find(head, at + 1)) {
    const std::size_t begin = at + head.size();
    found.push_back(Json::parse(text->substr(begin, text->find('\n', begin) - begin)));
  }
  return found;
}

TEST(LiveFeed, AnInstantIsShownWholeOnceTheNextOneBegins) {
  LiveFeed feed;
  std::uint64_t seen = 0;
  feed.Next(&seen, 0);
  Sample(1).WriteTo(feed);
  feed.Publish(kServer);
  EXPECT_TRUE(Events(feed.Next(&seen, 0), "frame").empty()) << "more of it may come";
  Sample(2).WriteTo(feed);
  feed.Publish(kServer);
  const auto frames = Events(feed.Next(&seen, 0), "frame");
  ASSERT_EQ(frames.size(), 1U);
  EXPECT_EQ(frames[0]["time"], 1e-6 * kSamplePeriod_us);
  const Messages m = Sample(1);
  const Json& row = frames[0]["rows"]["trajectory"];
  EXPECT_NEAR(row["root_y_m"].get<double>(), m.state.root_position[1], 1e-6);
  EXPECT_NEAR(row["command_" + m.control.motor_name[0] + "_n"].get<double>(),
              m.control.commanded_tension[0], 1e-6);
  EXPECT_EQ(frames[0]["shape"]["arms"].size(), kArms);
  EXPECT_EQ(frames[0]["drag"]["nodes"].size(), 3 * kNodes);
  EXPECT_EQ(frames[0]["drives"]["motors"].size(), kMotors);
  EXPECT_EQ(frames[0]["session"]["waypoints"].size(), kWaypoints);
  EXPECT_EQ(frames[0]["plan"]["root"].size(), 3 * kKnots);
}

TEST(LiveFeed, TheLastInstantOfARunIsShownToo) {
  LiveFeed feed;
  std::uint64_t seen = 0;
  feed.Next(&seen, 0);
  Sample(1).WriteTo(feed);
  feed.Publish(kServer, LiveFeed::Clock::now() + 1s);
  ASSERT_EQ(Events(feed.Next(&seen, 0), "frame").size(), 1U);
  feed.Publish(kServer, LiveFeed::Clock::now() + 2s);
  EXPECT_TRUE(Events(feed.Next(&seen, 0), "frame").empty()) << "once";
}

TEST(LiveFeed, ASlowViewerGetsTheNewestAndNothingIsKeptForIt) {
  LiveFeed feed;
  std::uint64_t slow = 0;
  feed.Next(&slow, 0);
  for (int k = 1; k <= 50; ++k) {
    Sample(k).WriteTo(feed);
    feed.Publish(kServer);
  }
  const auto frames = Events(feed.Next(&slow, 0), "frame");
  ASSERT_EQ(frames.size(), 1U);
  EXPECT_NEAR(frames[0]["time"].get<double>(), 49e-6 * kSamplePeriod_us, 1e-9);
  EXPECT_EQ(feed.Next(&slow, 0), nullptr);
}

TEST(LiveFeed, WhoComesLaterGetsTheRowsBefore) {
  LiveFeed feed;
  for (int k = 1; k <= 60; ++k) {
    Sample(k).WriteTo(feed);
    feed.Publish(kServer);
  }
  std::uint64_t seen = 0;
  const auto history = Events(feed.Next(&seen, 0), "history");
  ASSERT_EQ(history.size(), 1U);
  // 59 instants, 10 ms apart, of which those 100 ms apart are kept.
  ASSERT_EQ(history[0].size(), 6U);
  EXPECT_NEAR(history[0][1]["trajectory"]["time_s"].get<double>(), 0.11, 1e-9);
}

TEST(LiveFeed, HistoryIsBoundedHoweverLongTheRun) {
  LiveFeed feed;
  Messages m = Sample(1);
  for (int k = 1; k <= 3'000; ++k) {
    m.state.utime = k * kHistory_us;
    feed.Write(m.state);
    feed.Write([&] {
      EnergyTelemetry energy = m.energy;
      energy.utime = m.state.utime;
      return energy;
    }());
    feed.Publish(kServer);
  }
  std::uint64_t seen = 0;
  const LiveFeed::Text text = feed.Next(&seen, 0);
  EXPECT_LT(text->size(), kMostHistory_bytes + 200'000);
  EXPECT_GT(text->size(), kMostHistory_bytes / 2);
}

TEST(LiveFeed, TimeThatGoesBackIsAnotherRun) {
  LiveFeed feed;
  for (const int k : {20, 40, 41, 1, 2}) {
    Sample(k).WriteTo(feed);
    feed.Publish(kServer);
  }
  EXPECT_EQ(feed.figures().restarts, 1U);
  std::uint64_t seen = 0;
  const auto history = Events(feed.Next(&seen, 0), "history");
  ASSERT_EQ(history[0].size(), 1U) << "that of the run before is gone";
  EXPECT_NEAR(history[0][0]["trajectory"]["time_s"].get<double>(), 0.01, 1e-9);
}

TEST(LiveFeed, AShapeThatDoesNotFitTogetherIsRefused) {
  LiveFeed feed;
  std::uint64_t seen = 0;
  feed.Next(&seen, 0);
  Messages m = Sample(1);
  m.shape.arm_nodes[0] = 1'000'000;
  m.WriteTo(feed);
  m = Sample(2);
  m.shape.arm_nodes[0] = -1;
  m.WriteTo(feed);
  feed.Publish(kServer);
  EXPECT_EQ(feed.figures().refused, 2U);
  const auto frames = Events(feed.Next(&seen, 0), "frame");
  ASSERT_EQ(frames.size(), 1U);
  EXPECT_FALSE(frames[0].contains("shape"));
  EXPECT_FALSE(frames[0].contains("drag"));
}

TEST(LiveFeed, WhatIsNoNumberIsNullAndNoTextEndsAnEvent) {
  LiveFeed feed;
  std::uint64_t seen = 0;
  feed.Next(&seen, 0);
  Messages m = Sample(1);
  m.state.root_position = {std::numeric_limits<double>::quiet_NaN(),
                           std::numeric_limits<double>::infinity(), -0.0};
  m.session.scene = "a\n\nevent: frame\ndata: {}\n\n\xFF";
  m.WriteTo(feed);
  Sample(2).WriteTo(feed);
  m.session.utime = Sample(2).session.utime;
  feed.Write(m.session);
  feed.Publish(kServer);
  const auto frames = Events(feed.Next(&seen, 0), "frame");
  ASSERT_EQ(frames.size(), 1U);
  EXPECT_TRUE(frames[0]["rows"]["trajectory"]["root_x_m"].is_null());
  EXPECT_TRUE(frames[0]["rows"]["trajectory"]["root_y_m"].is_null());
  EXPECT_EQ(frames[0]["session"]["scene"].get<std::string>().substr(0, 3), "a\n\n");
}

TEST(LiveFeed, TwoRunsOnOneAddressAreToldApart) {
  LiveFeed feed;
  SessionTelemetry one;
  one.host = "lab";
  one.process = 7;
  feed.Write(one);
  EXPECT_FALSE(feed.figures().two_runs);
  ASSERT_TRUE(feed.figures().session);
  EXPECT_FALSE(feed.figures(LiveFeed::Clock::now() + 10s).session) << "it is quiet";
  SessionTelemetry other = one;
  other.process = 8;
  feed.Write(other);
  EXPECT_TRUE(feed.figures().two_runs);
}

TEST(LiveFeed, ReceiverPublisherAndViewersDoNotWaitForOneAnother) {
  constexpr int kSamples = 200;
  LiveFeed feed;
  std::atomic<bool> done{false};
  std::vector<std::thread> viewers;
  std::vector<double> last(3, -1.0);
  std::vector<int> backwards(3, 0);
  for (std::size_t v = 0; v < last.size(); ++v) {
    viewers.emplace_back([&, v] {
      std::uint64_t seen = 0;
      while (!done) {
        for (const Json& frame : Events(feed.Next(&seen, 5), "frame")) {
          const double time_s = frame["time"];
          if (time_s < last[v]) ++backwards[v];
          last[v] = time_s;
        }
      }
    });
  }
  std::thread publisher([&] {
    while (!done) {
      feed.Publish(kServer);
      feed.figures();
    }
  });
  for (int k = 1; k <= kSamples; ++k) Sample(k).WriteTo(feed);
  std::this_thread::sleep_for(300ms);  // the last instant is whole, and seen
  done = true;
  publisher.join();
  for (std::thread& viewer : viewers) viewer.join();
  for (std::size_t v = 0; v < last.size(); ++v) {
    EXPECT_NEAR(last[v], 1e-6 * kSamples * kSamplePeriod_us, 1e-9) << "viewer " << v;
    EXPECT_EQ(backwards[v], 0);
  }
}

TEST(LiveFeed, AWaitEndsWithTheServer) {
  LiveFeed feed;
  std::uint64_t seen = 0;
  feed.Next(&seen, 0);
  LiveFeed::Text got = std::make_shared<const std::string>("something");
  std::thread viewer([&] { got = feed.Next(&seen, 60'000); });
  feed.Close();
  viewer.join();
  EXPECT_EQ(got, nullptr);
}

}  // namespace
}  // namespace mantle::testing_tools
