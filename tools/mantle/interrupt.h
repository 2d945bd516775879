#pragma once

/// Ctrl-C and a polite kill end a run between two samples instead of in the middle of a file.

namespace mantle::tools {

/// From here on SIGINT and SIGTERM set a flag; a second one ends the program at once.
void CatchInterrupts();
bool Interrupted();

}  // namespace mantle::tools
