#include "firmware_sim/bus/candump_log.h"

#include <gtest/gtest.h>

#include <array>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <stdexcept>
#include <string>
#include <system_error>

#include "tests/firmware_sim/frames.h"

namespace mantle::firmware_sim {
namespace {

std::string Format(const CanFrame& frame, std::string_view interface = "vcan0") {
  std::array<char, kCandumpLineBytes> line{};
  return {line.data(), FormatCandumpLine(frame, interface, line)};
}

TEST(CandumpLog, WritesTheLinesOfCandump) {
  CanFrame frame = DataFrame(0x044, {0x2A, 0x36, 0x6C, 0x2B, 0xBA}, 1436509052249713);
  EXPECT_EQ(Format(frame), "(1436509052.249713) vcan0 044#2A366C2BBA\n");
  EXPECT_EQ(Format(DataFrame(0x080, {}, 1'000'001)), "(0000000001.000001) vcan0 080#\n");
  EXPECT_EQ(Format(ExtendedFrame(0x1F, {1})), "(0000000000.000000) vcan0 0000001F#01\n");
  EXPECT_EQ(Format(RemoteFrame(0x701, 0)), "(0000000000.000000) vcan0 701#R\n");
  EXPECT_EQ(Format(RemoteFrame(0x701, 4)), "(0000000000.000000) vcan0 701#R4\n");
  EXPECT_EQ(Format(ErrorFrame(0x80)), "(0000000000.000000) vcan0 20000080#0000000000000000\n");
}

TEST(CandumpLog, TheLongestLineFits) {
  CanFrame frame = ExtendedFrame(0x1FFFFFFF, {255, 255, 255, 255, 255, 255, 255, 255});
  frame.time_us = INT64_MAX;
  EXPECT_LE(Format(frame, "a_name_of_more_than_15").size(), kCandumpLineBytes);
  frame.time_us = -5;
  EXPECT_EQ(Format(frame).substr(0, 19), "(0000000000.000000)");
}

TEST(CandumpLog, ReadsBackWhatItWrites) {
  for (const CanFrame& frame :
       {DataFrame(0x7FF, {1, 2, 3, 4, 5, 6, 7, 8}, 1'700'000'000'000'001), DataFrame(0, {}),
        ExtendedFrame(0x12345678, {0xFF}), RemoteFrame(0x123, 8), ErrorFrame(0x1)}) {
    std::string line = Format(frame);
    line.pop_back();
    CanFrame back;
    ASSERT_EQ(ParseCandumpLine(line, back), CandumpParse::kFrame) << line;
    ExpectSameFrame(back, frame);
    EXPECT_EQ(back.time_us, frame.time_us);
  }
}

TEST(CandumpLog, ReadsDirectionLettersAndTellsFdFramesApart) {
  CanFrame frame;
  EXPECT_EQ(ParseCandumpLine("(1.000002) can0 123#11 R", frame), CandumpParse::kFrame);
  EXPECT_EQ(frame.time_us, 1'000'002);
  EXPECT_EQ(ParseCandumpLine("(1.000002) can0 123##0112233", frame), CandumpParse::kFdFrame);
}

TEST(CandumpLog, RefusesBrokenLines) {
  for (const char* line : {"", "hello", "(1.0) can0 123#", "(1.000000 can0 123#", "(1.000000) can0",
                           "(x.000000) c 1#", "(1.000000) can0 12#", "(1.000000) can0 1234#",
                           "(1.000000) can0 FFF#", "(1.000000) can0 12G#", "(1.000000) can0 123#1",
                           "(1.000000) can0 123#0G", "(1.000000) can0 123#112233445566778899",
                           "(1.000000) can0 123#R9", "(1.000000) can0 123"}) {
    CanFrame frame = DataFrame(0x55, {1});
    EXPECT_EQ(ParseCandumpLine(line, frame), CandumpParse::kMalformed) << line;
    EXPECT_EQ(frame.id, 0x55U);
  }
}

TEST(CandumpLog, AFileNamesTheLineThatIsWrong) {
  std::istringstream good(
      "(1.000000) can0 123#11\r\n\n(2.000000) can0 124##0\n(3.000000) can0 7#\n");
  try {
    ReadCandumpLog(good);
    FAIL();
  } catch (const std::invalid_argument& error) {
    EXPECT_NE(std::string(error.what()).find("line 4"), std::string::npos);
  }
  std::istringstream fine("(1.000000) can0 123#11\r\n\n(2.000000) can0 124##0\n");
  const CandumpLog log = ReadCandumpLog(fine);
  EXPECT_EQ(log.frames.size(), 1U);
  EXPECT_EQ(log.skipped, 1U);
}

TEST(CandumpLog, TheWriterMakesAFileThatTheReaderTakes) {
  const std::string path = ::testing::TempDir() + "mantle_candump_log_test.log";
  {
    CandumpWriter writer(path, "vcan0");
    for (int i = 0; i < 1000; ++i) writer.Write(DataFrame(0x181, {i & 0xFF}, i * 1000));
    EXPECT_TRUE(writer.Flush());
    EXPECT_EQ(writer.written(), 1000U);
  }
  std::ifstream in(path);
  const CandumpLog log = ReadCandumpLog(in);
  ASSERT_EQ(log.frames.size(), 1000U);
  EXPECT_EQ(log.frames[999].time_us, 999'000);
  EXPECT_THROW(CandumpWriter("/nonexistent/folder/x.log", "vcan0"), std::system_error);
  std::filesystem::remove(path);
}

}  // namespace
}  // namespace mantle::firmware_sim
