#include "tools/mantle/module.h"

#include <gtest/gtest.h>

#include "tests/tools/program.h"

namespace mantle::testing_tools {
namespace {

// What only planning and telemetry need.
constexpr const char* kHeavy[] = {"libipopt",    "libdmumps", "libblas", "liblapack",
                                  "libgfortran", "liblcm",    "libglib"};

// A copy of the program that stands alone, without its modules.
std::filesystem::path Alone(const std::filesystem::path& folder) {
  std::filesystem::copy_file(tests::BinaryPath("mantle"), folder / "mantle");
  return folder / "mantle";
}

Outcome Shell(const std::filesystem::path& folder, const std::string& command) {
  // After a run of the built program that prints nothing.
  return Mantle(folder, "--version >/dev/null; " + command);
}

TEST(Module, TheProgramStartsWithoutSolverAndLcm) {
  const auto folder = FreshFolder("module_start");
  const Outcome outcome =
      Shell(folder, "LD_TRACE_LOADED_OBJECTS=1 '" + tests::BinaryPath("mantle") + "' --version");
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  ASSERT_NE(outcome.out.find("libstdc++"), std::string::npos) << outcome.out;
  for (const char* name : kHeavy) {
    EXPECT_EQ(outcome.out.find(name), std::string::npos) << name << " in\n" << outcome.out;
  }
}

TEST(Module, ARunLoadsTheModulesThatItNeeds) {
  const auto folder = FreshFolder("module_run");
  const auto loaded = [&](const std::string& scene, const std::string& options = "") {
    return Shell(folder, "LD_DEBUG=files '" + tests::BinaryPath("mantle") + "' run " +
                             Scene(scene) + " --set time.duration=0.1 --out out" + options);
  };
  const Outcome plain = loaded("arm_dynamic", " --shape-every 0");
  ASSERT_EQ(plain.status, 0) << plain.err.substr(0, 2000);
  EXPECT_NE(plain.err.find("libfmt"), std::string::npos) << "LD_DEBUG shows what is loaded";
  for (const char* name : kHeavy) EXPECT_EQ(plain.err.find(name), std::string::npos) << name;
  const Outcome logged = loaded("arm_dynamic");
  ASSERT_EQ(logged.status, 0) << logged.err.substr(0, 2000);
  EXPECT_NE(logged.err.find("mantle_lcm.so"), std::string::npos);
  EXPECT_EQ(logged.err.find("libipopt"), std::string::npos) << "nothing is planned";
  const Outcome closed = loaded("reach");
  ASSERT_EQ(closed.status, 0) << closed.err.substr(0, 2000);
  EXPECT_NE(closed.err.find("mantle_ipopt.so"), std::string::npos);
  EXPECT_NE(closed.err.find("mantle_lcm.so"), std::string::npos);
}

TEST(Module, ABaselineNeedsNoSolver) {
  const auto folder = FreshFolder("module_baseline");
  const Outcome outcome =
      Shell(folder, "LD_DEBUG=files '" + tests::BinaryPath("mantle") + "' run " + Scene("reach") +
                        " --controller pid --set time.duration=0.1 --out out");
  ASSERT_EQ(outcome.status, 0) << outcome.err.substr(0, 2000);
  EXPECT_EQ(outcome.err.find("mantle_ipopt.so"), std::string::npos);
}

TEST(Module, AMissingOneIsNamed) {
  const auto folder = FreshFolder("module_missing");
  const std::string program = Alone(folder).string();
  const Outcome outcome = Shell(folder, "'" + program + "' run " + Scene("reach") + " --out out");
  EXPECT_EQ(outcome.status, 1);
  EXPECT_NE(outcome.err.find("lib/mantle/modules/mantle_ipopt.so: is missing"), std::string::npos)
      << outcome.err;
  EXPECT_NE(outcome.err.find("beside " + program), std::string::npos) << outcome.err;
}

TEST(Module, ADamagedOneIsNamedWithTheLoadersReason) {
  const auto folder = FreshFolder("module_damaged");
  const std::string program = Alone(folder).string();
  const auto module = folder / "lib" / "mantle" / "modules" / "mantle_ipopt.so";
  std::filesystem::create_directories(module.parent_path());
  std::ofstream(module) << "not a library";
  const Outcome outcome = Shell(folder, "'" + program + "' run " + Scene("reach") + " --out out");
  EXPECT_EQ(outcome.status, 1);
  EXPECT_NE(outcome.err.find(module.string()), std::string::npos) << outcome.err;
}

TEST(Module, ASymbolThatItDoesNotHaveIsNamed) {
  // This test stands in build/tests, its modules in build/lib/mantle/modules.
  std::filesystem::create_directories(tests::BinaryPath("tests/lib/mantle/modules"));
  const std::filesystem::path module = tests::BinaryPath("tests/lib/mantle/modules/mantle_lcm.so");
  std::filesystem::copy_file(tests::BinaryPath("lib/mantle/modules/mantle_lcm.so"), module,
                             std::filesystem::copy_options::overwrite_existing);
  EXPECT_EQ(tools::ModulePath("mantle_lcm.so"), module);
  EXPECT_NE(tools::ModuleSymbol("mantle_lcm.so", "mantle_lcm_functions"), nullptr);
  try {
    tools::ModuleSymbol("mantle_lcm.so", "mantle_nonsense");
    FAIL() << "must be refused";
  } catch (const std::runtime_error& error) {
    EXPECT_NE(std::string(error.what()).find("mantle_lcm.so: has no symbol mantle_nonsense"),
              std::string::npos)
        << error.what();
  }
}

}  // namespace
}  // namespace mantle::testing_tools
