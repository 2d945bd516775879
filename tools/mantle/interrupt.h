#pragma once

/// Ctrl-C and a polite kill end a run between two samples instead of in the middle of a file.

namespace mantle::tools {

/// From here on SIGINT and SIGTERM set a flag; a second one ends the program at once. To be called
/// before a folder of results is made: else one that comes in between would leave it without a
/// summary.
void CatchInterrupts();
bool Interrupted();

}  // namespace mantle::tools
