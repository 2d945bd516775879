#include "tools/mantle/exit_status.h"

#include <exception>
#include <new>

#include "loop/scene/toml_document.h"
#include "tools/mantle/bad_input.h"
#include "tools/mantle/standard_output.h"

namespace mantle::tools {
namespace {

int Guarded(const std::function<int()>& command) {
  try {
    return command();
  } catch (const BadInput& error) {
    ComplainText(error.what());
    return kExitBadInput;
  } catch (const scene::BadScene& error) {
    ComplainText(error.what());
    return kExitBadInput;
  } catch (const CannotGoOn& error) {
    ComplainText(error.what());
    return kExitCannotContinue;
  } catch (const std::bad_alloc&) {
    ComplainText("out of memory");
    return kExitCannotContinue;
  } catch (const std::exception& error) {
    ComplainText(error.what());
    return kExitFault;
  }
}

}  // namespace

int StatusOf(const std::function<int()>& command) noexcept {
  const int status = Guarded(command);
  if (status == kExitFault) return status;
  try {
    FlushOutput();
  } catch (const CannotPrint& error) {
    if (status != 0) return status;  // the worse of the two has been said
    ComplainText(error.what());
    return kExitFault;
  }
  return status;
}

}  // namespace mantle::tools
