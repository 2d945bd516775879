#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <set>

#include "tests/support/paths.h"
#include "tests/tools/program.h"

/// What a folder of results holds after every ending, and that two runs do not mix in one.

namespace mantle::testing_tools {
namespace {

namespace fs = std::filesystem;
using Names = std::set<std::string>;

const std::string kRun = "run " + Scene("arm_dynamic") + " --set time.duration=0.05";

Names FilesIn(const fs::path& folder) {
  Names names;
  for (const auto& f : fs::directory_iterator(folder)) names.insert(f.path().filename().string());
  return names;
}

long Lines(const std::string& text) { return std::count(text.begin(), text.end(), '\n'); }

void Put(const fs::path& file, const std::string& text) {
  fs::create_directories(file.parent_path());
  std::ofstream(file) << text;
}

TEST(ResultFolder, HoldsNothingButTheResultsOfTheLastRun) {
  const auto folder = FreshFolder("folder_replaced");
  ASSERT_EQ(Mantle(folder, kRun + " --out out --checkpoint-every 0.02").status, 0);
  EXPECT_EQ(FilesIn(folder / "out"),
            (Names{"summary.json", "telemetry.lcmlog", "trajectory.csv", "checkpoint"}));
  ASSERT_EQ(Mantle(folder, "static " + Scene("elastica") + " --out out/").status, 0);
  EXPECT_EQ(FilesIn(folder / "out"),
            (Names{"summary.json", "telemetry.lcmlog", "path.csv", "shape.csv"}));
  EXPECT_EQ(FilesIn(folder), Names{"out"}) << "neither a lock nor a partial folder stays";
}

TEST(ResultFolder, KeepsWhatIsNotAResult) {
  const auto folder = FreshFolder("folder_foreign");
  Put(folder / "out/notes.txt", "mine\n");
  Put(folder / "out/trajectory.png", "of an earlier run\n");
  Put(folder / "out/other/summary.json", "{}\n");
  ASSERT_EQ(Mantle(folder, kRun + " --out out").status, 0);
  EXPECT_EQ(FilesIn(folder / "out"),
            (Names{"notes.txt", "other", "summary.json", "telemetry.lcmlog", "trajectory.csv"}));
  EXPECT_EQ(ReadFile(folder / "out/notes.txt"), "mine\n");
  EXPECT_EQ(ReadFile(folder / "out/other/summary.json"), "{}\n");
  EXPECT_EQ(FilesIn(folder), Names{"out"});
}

TEST(ResultFolder, MayBeTheCurrentFolderOrALinkToOne) {
  const auto folder = FreshFolder("folder_current");
  Put(folder / "here/summary.json", "{}\n");
  fs::create_symlink("here", folder / "link");
  const auto inode = [](const fs::path& path) {
    struct stat status {};
    stat(path.c_str(), &status);
    return status.st_ino;
  };
  const ino_t before = inode(folder / "here");
  ASSERT_EQ(Mantle(folder / "here", kRun + " --out .").status, 0);
  EXPECT_EQ(FilesIn(folder / "here"),
            (Names{"summary.json", "telemetry.lcmlog", "trajectory.csv"}));
  EXPECT_EQ(inode(folder / "here"), before) << "who stands in a folder keeps standing in it";
  ASSERT_EQ(Mantle(folder, "static " + Scene("elastica") + " --out link").status, 0);
  EXPECT_TRUE(fs::is_symlink(fs::symlink_status(folder / "link")));
  EXPECT_EQ(FilesIn(folder / "here"),
            (Names{"summary.json", "telemetry.lcmlog", "path.csv", "shape.csv"}));
}

TEST(ResultFolder, IsRefusedWhileAnotherRunHasIt) {
  const auto folder = FreshFolder("folder_locked");
  Put(folder / "out/summary.json", "{}\n");
  const Outcome outcome =
      Mantle(folder,
             "run " + Scene("arm_dynamic") +
                 " --set time.duration=1e5 --out out & p=$!; while [ ! -e "
                 "out.partial/trajectory.csv ] && kill -0 $p; do sleep 0.05; done; echo $p >pid; " +
                 Program() + " " + kRun +
                 " --out ./out/ 2>second; echo $? >status; cat out.partial/trajectory.csv "
                 ">between; kill -INT $p; wait $p");
  EXPECT_EQ(outcome.status, 3) << outcome.err;
  EXPECT_EQ(ReadFile(folder / "status"), "2\n");
  std::string pid = ReadFile(folder / "pid");
  pid.pop_back();
  EXPECT_EQ(ReadFile(folder / "second"), "mantle: --out: ./out/: process " + pid +
                                             " writes there: must be a folder of this run "
                                             "alone\n");
  EXPECT_EQ(ReadFile(folder / "out/summary.json"), "{}\n");
  EXPECT_EQ(ReadJson(folder / "out.partial/summary.json").at("reason"), "interrupted");
}

TEST(ResultFolder, OfAKilledRunIsFreeAndHoldsWhatWasReached) {
  const auto folder = FreshFolder("folder_killed");
  Put(folder / "out/summary.json", "{}\n");
  Mantle(folder, "run " + Scene("arm_dynamic") +
                     " --set time.duration=1e5 --out out --checkpoint-every 0.05 & p=$!; while [ ! "
                     "-e out.partial/checkpoint ] && kill -0 $p; do sleep 0.05; done; kill -KILL "
                     "$p; wait $p");
  EXPECT_EQ(FilesIn(folder / "out"), Names{"summary.json"});
  EXPECT_EQ(ReadFile(folder / "out/summary.json"), "{}\n");
  Names left = FilesIn(folder / "out.partial");
  left.erase("checkpoint.new");  // it may be killed while it writes one
  EXPECT_EQ(left, (Names{"checkpoint", "telemetry.lcmlog", "trajectory.csv"}));
  // It goes on from there, and what it goes on from is not lost before there is something newer.
  const Outcome resumed =
      Mantle(folder, "run " + Scene("arm_dynamic") +
                         " --set time.duration=1e5 --out out --resume out.partial/checkpoint & "
                         "p=$!; sleep 0.5; kill -KILL $p; wait $p");
  left = FilesIn(folder / "out.partial");
  EXPECT_EQ(left, (Names{"checkpoint", "telemetry.lcmlog", "trajectory.csv"})) << resumed.err;
  ASSERT_EQ(Mantle(folder, kRun + " --out out").status, 0);
  EXPECT_EQ(FilesIn(folder / "out"), (Names{"summary.json", "telemetry.lcmlog", "trajectory.csv"}));
}

TEST(ResultFolder, IsAsItWasAfterBadInput) {
  const auto folder = FreshFolder("folder_bad_input");
  Put(folder / "out/summary.json", "{}\n");
  Put(folder / "out.partial/checkpoint", "precious\n");
  const std::string steer = "run " + Scene("steer") + " --out out ";
  for (const std::string& arguments :
       {steer + "--lcm 'udpm://239.255.76.67:99999'", steer + "--lcm tcp://nowhere",
        steer + "--bus can:nowhere9", steer + "--record no/such/folder/x",
        kRun + " --out out --resume out.partial/checkpoint", kRun + " --out out --set time.step=0",
        "static " + Scene("paper") + " --out out", "compare " + Scene("elastica") + " --out out",
        "tune " + Scene("paper") + " --out out",
        "study control " + Scene("paper") + " --out out"}) {
    const Outcome outcome = Mantle(folder, arguments);
    EXPECT_EQ(outcome.status, 2) << arguments << "\n" << outcome.err;
    EXPECT_EQ(Lines(outcome.err), 1) << outcome.err;
    EXPECT_EQ(FilesIn(folder), (Names{"out", "out.partial"})) << arguments;
    EXPECT_EQ(ReadFile(folder / "out/summary.json"), "{}\n");
    EXPECT_EQ(ReadFile(folder / "out.partial/checkpoint"), "precious\n");
  }
}

TEST(ResultFolder, ThatCannotBeIsRefused) {
  const auto folder = FreshFolder("folder_refused");
  Put(folder / "file", "mine\n");
  fs::create_symlink("nowhere", folder / "dangling");
  Put(folder / "precious", "mine\n");
  fs::create_symlink("precious", folder / "taken.partial");
  for (const std::string out : {"file", "dangling", "taken", "/", "/proc/out"}) {
    const Outcome outcome = Mantle(folder, kRun + " --out " + out);
    EXPECT_EQ(outcome.status, 2) << out << outcome.err;
    EXPECT_EQ(Lines(outcome.err), 1) << outcome.err;
  }
  EXPECT_EQ(ReadFile(folder / "file"), "mine\n");
  EXPECT_EQ(ReadFile(folder / "precious"), "mine\n");
  EXPECT_FALSE(fs::exists(folder / "nowhere"));
}

TEST(ResultFolder, NoLinkInsideIsFollowed) {
  const auto folder = FreshFolder("folder_links");
  Put(folder / "precious", "mine\n");
  fs::create_directories(folder / "out.partial");
  for (const char* name : {"summary.json", "trajectory.csv", "trajectory.csv.new", "checkpoint"}) {
    fs::create_symlink("../precious", folder / "out.partial" / name);
  }
  fs::create_directories(folder / "out");
  fs::create_symlink("../precious", folder / "out/summary.json");
  ASSERT_EQ(Mantle(folder, kRun + " --out out").status, 0);
  EXPECT_EQ(ReadFile(folder / "precious"), "mine\n");
  EXPECT_FALSE(fs::is_symlink(fs::symlink_status(folder / "out/summary.json")));
  EXPECT_TRUE(ReadJson(folder / "out/summary.json").at("complete").get<bool>());
}

TEST(ResultFolder, AFullDiskEndsTheRunWhenItIsFull) {
  // A limit of the size of files stands for the disk's: 200 blocks of 512 or 1024 bytes.
  const auto folder = FreshFolder("folder_full");
  Put(folder / "out/summary.json", "{}\n");
  const auto run_out_of_disk = [&](const std::string& options, const std::string& file) {
    const Outcome outcome = Mantle(
        folder, "--version >version; ulimit -f 200; " + Program() + " run " + Scene("arm_dynamic") +
                    " --set time.duration=1e5 --set output.interval=0.01 --out out" + options);
    EXPECT_EQ(outcome.status, 3) << outcome.err;
    EXPECT_EQ(Lines(outcome.err), 1) << outcome.err;
    EXPECT_NE(outcome.err.find(file + ": cannot be written: "), std::string::npos) << outcome.err;
    EXPECT_EQ(ReadFile(folder / "out/summary.json"), "{}\n");
    const auto rows = ReadCsv(folder / "out.partial/trajectory.csv");
    ASSERT_GT(rows.size(), 5U);
    for (const auto& row : rows) EXPECT_EQ(row.size(), rows[0].size()) << "whole rows alone";
  };
  run_out_of_disk(" --shape-every 0", "trajectory.csv");
  EXPECT_EQ(FilesIn(folder / "out.partial"), Names{"trajectory.csv"}) << "no empty summary";
  run_out_of_disk("", "telemetry.lcmlog");
  EXPECT_EQ(FilesIn(folder / "out.partial"), (Names{"telemetry.lcmlog", "trajectory.csv"}));
  const Outcome log = Mantle(folder, "log out.partial/telemetry.lcmlog");
  EXPECT_EQ(log.status, 0) << "whole messages alone: " << log.err;
}

}  // namespace
}  // namespace mantle::testing_tools
