#include "tools/mantle/module.h"

#include <dlfcn.h>
#include <fmt/format.h>

#include <stdexcept>
#include <string_view>

#include "mantle/version.h"

namespace mantle::tools {
namespace {

std::runtime_error CannotUse(const std::filesystem::path& file, std::string_view why) {
  return std::runtime_error(fmt::format("{}: {}: this part of Mantle must be installed beside {}",
                                        file.string(), why,
                                        std::filesystem::read_symlink("/proc/self/exe").string()));
}

template <typename Function>
Function* Lookup(void* module, const std::filesystem::path& file, const char* symbol) {
  void* address = dlsym(module, symbol);
  if (address == nullptr) throw CannotUse(file, fmt::format("has no symbol {}", symbol));
  return reinterpret_cast<Function*>(address);
}

}  // namespace

std::filesystem::path ModulePath(const char* module) {
  const std::filesystem::path beside =
      std::filesystem::read_symlink("/proc/self/exe").parent_path();
  const std::filesystem::path built = beside / "lib" / "mantle" / "modules" / module;
  if (std::filesystem::exists(built)) return built;
  return beside.parent_path() / "lib" / "mantle" / "modules" / module;
}

void* ModuleSymbol(const char* module, const char* symbol) {
  const std::filesystem::path file = ModulePath(module);
  if (!std::filesystem::exists(file)) throw CannotUse(file, "is missing");
  // Every symbol bound now: a library that lacks one is noticed here and not in the control loop.
  void* handle = dlopen(file.c_str(), RTLD_NOW | RTLD_LOCAL);  // counted: opened once, kept
  if (handle == nullptr) throw CannotUse(file, dlerror());
  const std::string_view version = Lookup<const char*()>(handle, file, "mantle_module_version")();
  if (version != kVersion) {
    throw CannotUse(file, fmt::format("is of version {}, must be {}", version, kVersion));
  }
  return reinterpret_cast<void*>(Lookup<void()>(handle, file, symbol));
}

std::unique_ptr<controller::Solver> MakeModuleSolver() {
  using Make = controller::Solver*();
  static Make* const make =
      reinterpret_cast<Make*>(ModuleSymbol("mantle_ipopt.so", "mantle_make_solver"));
  return std::unique_ptr<controller::Solver>(make());
}

}  // namespace mantle::tools
