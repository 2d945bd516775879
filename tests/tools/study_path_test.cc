#include "tools/studies/study_path.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "tests/support/paths.h"
#include "tools/mantle/bad_input.h"

namespace mantle::tools {
namespace {

StudyPath Straight(double offset_m, double step_s, int frames) {
  StudyPath path;
  path.body_length_m = 0.5;
  for (int i = 0; i < frames; ++i) {
    StudyFrame f;
    f.time_s = i * step_s;
    f.root_m = {offset_m * i, 0, 0.1 * f.time_s};
    f.heading = {std::sin(0.01 * offset_m * i), 0, std::cos(0.01 * offset_m * i)};
    f.tips_m = {f.root_m, f.root_m + model::Vector3(0, 2 * offset_m * i, 0)};
    f.volume_m3 = 1e-4 * (1 + 0.1 * f.time_s) + 1e-6 * offset_m;
    f.energy_j = f.time_s + offset_m;
    path.frames.push_back(f);
  }
  return path;
}

TEST(StudyPath, ErrorsAreOfBodyLengthAndOfTheReferencesChanges) {
  const StudyPath reference = Straight(0, 0.1, 11), path = Straight(0.01, 0.1, 11);
  const PathErrors e = ComparePaths(path, reference);
  EXPECT_EQ(e.frames, 11);
  EXPECT_NEAR(e.root.largest, 0.1 / 0.5, 1e-12);
  EXPECT_NEAR(e.tip.largest, std::hypot(0.1, 0.2) / 0.5, 1e-12);
  EXPECT_NEAR(e.heading_rad.final, 0.001, 1e-12);
  EXPECT_NEAR(e.volume.largest, 1e-8 / 1e-5, 1e-9);  // of the change by a tenth over a second
  EXPECT_NEAR(e.energy.largest, 0.01, 1e-12);
  EXPECT_EQ(Headline(e, reference), e.tip.largest);
}

TEST(StudyPath, OfAHeldMantleTheVolumeCounts) {
  StudyPath reference = Straight(0, 0.1, 3), path = Straight(0.01, 0.1, 3);
  for (StudyPath* p : {&reference, &path}) {
    p->held = true;
    for (StudyFrame& f : p->frames) f.tips_m.clear();
  }
  const PathErrors e = ComparePaths(path, reference);
  EXPECT_EQ(Headline(e, reference), e.volume.largest);
}

TEST(StudyPath, ComparesAtCommonInstantsAlone) {
  const StudyPath reference = Straight(0, 0.1, 11);
  EXPECT_EQ(ComparePaths(Straight(0.01, 0.2, 6), reference).frames, 6);
  EXPECT_EQ(ComparePaths(Straight(0.01, 0.05, 21), reference).frames, 11);
  EXPECT_THROW(ComparePaths(Straight(0.01, 0.033, 20), reference), std::invalid_argument);
  StudyPath one_arm = Straight(0, 0.1, 3);
  for (StudyFrame& f : one_arm.frames) f.tips_m.pop_back();
  EXPECT_THROW(ComparePaths(one_arm, reference), std::invalid_argument);
}

TEST(StudyPath, ReadsBackToTheSameBits) {
  const auto file = std::filesystem::path(tests::BinaryPath("tests")) / "study_path_test.path";
  const StudyPath path = Straight(0.012345678901234567, 1.0 / 3, 7);
  std::ofstream(file) << StudyPathText(path);
  const StudyPath back = ReadStudyPath(file);
  EXPECT_EQ(StudyPathText(back), StudyPathText(path));
  EXPECT_EQ(back.frames[6].tips_m[1], path.frames[6].tips_m[1]);
  const std::string text = StudyPathText(path);
  std::ofstream(file) << text.substr(0, text.size() - 40);
  EXPECT_THROW(ReadStudyPath(file), BadInput);
  std::ofstream(file) << "something else";
  EXPECT_THROW(ReadStudyPath(file), BadInput);
  std::filesystem::remove(file);
}

}  // namespace
}  // namespace mantle::tools
