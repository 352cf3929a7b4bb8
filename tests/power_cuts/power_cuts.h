#pragma once

#include "tests/power_cuts/cut_tally.h"

namespace axlecast {

// Each function runs a random workload on a recorded disk, cuts the power at every point, starts the product's code again on
// each state, and counts every breach of its documented promises.

// The bridge's journal (docs/journal.md): what returned true is there, once; nothing else is; no epoch is given again.
[[nodiscard]] CutTally CutJournal(const CutOrder& order);

// The recorder's logs (docs/record.md): what is older than the sync interval is there; a seal that matches covers only events
// that were written so; a log can be continued.
[[nodiscard]] CutTally CutLogs(const CutOrder& order);

// The closed logs of a recorder that are compressed, or deleted before they were shipped (docs/record.md): each is complete in one of
// its forms, or a hole.
[[nodiscard]] CutTally CutOutbox(const CutOrder& order);

// Files that are written in one step (platform/os/new_file): the old content or the new one, and the new one after the return.
[[nodiscard]] CutTally CutNewFiles(const CutOrder& order);

}  // namespace axlecast
