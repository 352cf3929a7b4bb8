// Power cuts of everything that the product writes durably, at many points, each in several states of the disk.
#include <cinttypes>
#include <cstdio>
#include <ctime>
#include <string>

#include "tests/campaign/campaign_main.h"
#include "tests/power_cuts/power_cuts.h"

namespace axlecast {
namespace {

struct Mode {
  const char* name;
  const char* text;
  CutTally (*cut)(const CutOrder& order);
  int operations;
  int long_operations;  // of every 50th workload, without a restart: SQLite's log becomes full
  double share;         // of the points
};

constexpr Mode kModes[] = {
    {"journal", "the bridge's journal", CutJournal, 40, 350, 0.4},
    {"logs", "the recorder's logs", CutLogs, 40, 120, 0.3},
    {"new_files", "keys, configs, backups and other new files", CutNewFiles, 60, 200, 0.15},
    {"outbox", "closed logs that are compressed or deleted unshipped", CutOutbox, 12, 40, 0.15},
};

bool Run(const Mode& mode, std::int64_t count) {
  CutTally sum;
  const std::clock_t begin = std::clock();
  const auto points = static_cast<std::int64_t>(static_cast<double>(count) * mode.share);
  std::uint64_t seed = 0;
  while (sum.points < points && sum.breaches < 100) {
    CutOrder order;
    order.seed = ++seed;
    order.random_states = 1;
    const bool is_long = seed % 50 == 0;
    order.operations = is_long ? mode.long_operations : mode.operations;
    if (is_long) {
      order.stride = 11;
      order.restarts = 100'000;
    }
    if (count < 10'000) order.stride = 7;  // so that a short run has several workloads
    sum.Add(mode.cut(order));
  }
  const double seconds = static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC;
  std::printf("%s: %" PRIu64 " workloads, power cut at %" PRId64 " points, %" PRId64
              " states of the disk (%.0f in a second of processor time), of these %" PRId64
              " after a second cut: %" PRId64 " breaches\n",
              mode.text, seed, sum.points, sum.states, static_cast<double>(sum.states) / seconds, sum.second_cuts,
              sum.breaches);
  for (const std::string& text : sum.texts) std::printf("  %s\n", text.c_str());
  return sum.breaches == 0;
}

}  // namespace
}  // namespace axlecast

int main(int argc, char** argv) {
  return axlecast::CampaignMain(argc, argv, "power_cuts POINTS [journal|logs|new_files|outbox]...",
                                "nothing acknowledged was lost or doubled, and every file could be read",
                                axlecast::kModes, axlecast::Run);
}
