// What composing the rows of a fleet database costs: reads a log, composes batches of one stretch each (as a shipper does that
// keeps up) or of many (backfill), and prints one JSON object: events per second of CPU time of one core, and the bytes that a
// sample needs. `row_bench LOG [SECONDS_PER_BATCH [DETAIL]]`.

#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <fstream>
#include <iterator>
#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "core/config/load.h"
#include "tools/fleet/column.h"
#include "tools/fleet/row_composer.h"
#include "tools/log/log_reader.h"

namespace axlecast {
namespace {

// s of CPU time of this process.
double CpuTime() {
  timespec now{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + static_cast<double>(now.tv_nsec) * 1e-9;
}

struct Totals {
  EventCounts counts;
  std::int64_t samples = 0;
  std::int64_t chunks = 0;
  std::int64_t seconds = 0;
  std::int64_t minutes = 0;
  std::int64_t bodies = 0;                      // bytes
  std::map<std::string, std::int64_t> columns;  // bytes by id

  void Add(const BatchRows& rows) {
    counts.stored += rows.counts.stored;
    counts.rolled_up += rows.counts.rolled_up;
    counts.repeated += rows.counts.repeated;
    counts.excluded += rows.counts.excluded;
    counts.odd += rows.counts.odd;
    counts.bookkeeping += rows.counts.bookkeeping;
    samples += rows.samples;
    chunks += static_cast<std::int64_t>(rows.chunks.size());
    seconds += static_cast<std::int64_t>(rows.seconds.size());
    minutes += static_cast<std::int64_t>(rows.minutes.size());
    for (const PositionChunkRow& chunk : rows.chunks) {
      bodies += static_cast<std::int64_t>(chunk.body.size());
      const auto split = SplitBody(chunk.body);
      if (!split) std::abort();
      for (const ColumnView& column : *split) {
        columns[std::to_string(column.id)] += static_cast<std::int64_t>(column.data.size()) + 7;
      }
    }
  }
};

DetailRules RulesOf(const std::string& detail) {
  DetailRules rules;
  ChannelDetail positions;
  if (detail == "full") positions.detail = Detail::kFull;
  if (detail == "rollup") positions.detail = Detail::kRollup;
  if (!rules.Add("^POSITION", positions)) std::abort();
  return rules;
}

int Run(const std::string& file, std::int64_t seconds_per_batch, const std::string& detail) {
  std::ifstream stream(file, std::ios::binary);
  const std::vector<char> text{std::istreambuf_iterator<char>(stream), {}};
  const Bytes log(reinterpret_cast<const std::uint8_t*>(text.data()), text.size());
  std::vector<LogEvent> events;
  std::optional<MachineConfig> machine;
  LogReader reader(log);
  for (auto event = reader.Next(); event; event = reader.Next()) {
    events.push_back(*event);
    if (event->channel == kMachineChannel) {
      ConfigErrors errors(file);
      machine = ParseConfig(std::string(AsText(event->data)), errors);
      if (!machine) std::fprintf(stderr, "%s", errors.Text().c_str());
    }
  }
  if (!machine || machine->recorder.logs.empty()) return 1;

  RowComposer composer(LogFactsOf(*machine), machine->recorder.logs[0].name, RulesOf(detail),
                       {.first = 0, .end = INT64_MAX / 2});
  std::vector<BatchRows> batches;
  std::int64_t stretches = 0;
  const double begin = CpuTime();
  for (const LogEvent& event : events) {
    composer.Add(event);
    if (event.channel == kSealChannel && ++stretches % seconds_per_batch == 0) batches.push_back(composer.Take());
  }
  batches.push_back(composer.Take());
  const double cpu = CpuTime() - begin;

  Totals totals;
  for (const BatchRows& rows : batches) totals.Add(rows);
  const auto n = static_cast<double>(totals.samples);
  nlohmann::ordered_json columns;
  for (const auto& [id, bytes] : totals.columns) columns[id] = static_cast<double>(bytes) / n;
  const nlohmann::ordered_json result{{"events", totals.counts.Total()},
                                      {"events_of_log", static_cast<std::int64_t>(events.size())},
                                      {"events_per_cpu_second", static_cast<double>(events.size()) / cpu},
                                      {"samples", totals.samples},
                                      {"repeated", totals.counts.repeated},
                                      {"odd", totals.counts.odd},
                                      {"chunks", totals.chunks},
                                      {"seconds", totals.seconds},
                                      {"minutes", totals.minutes},
                                      {"body_bytes_per_sample", static_cast<double>(totals.bodies) / n},
                                      {"column_bytes_per_sample", columns}};
  std::printf("%s\n", result.dump(2).c_str());
  return totals.counts.Total() == static_cast<std::int64_t>(events.size()) ? 0 : 1;
}

}  // namespace
}  // namespace axlecast

int main(int argc, char** argv) {
  if (argc < 2) return 2;
  return axlecast::Run(argv[1], argc > 2 ? std::atoll(argv[2]) : 1, argc > 3 ? argv[3] : "samples");
}
