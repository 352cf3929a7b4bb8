#pragma once

namespace axlecast {

// Overwrites what functions that have returned left on the calling thread's stack, 64 KiB of it. Compilers spill copies
// of what passes through registers; a password that was handled is wiped nowhere else.
void WipeStack();

}  // namespace axlecast
