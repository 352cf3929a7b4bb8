#include "tools/fleet/read/log_check.h"

#include <algorithm>
#include <utility>

#include "core/base/text.h"
#include "core/base/utc_text.h"
#include "tools/fleet/channel_choice.h"
#include "tools/fleet/position_chunk.h"
#include "tools/fleet/read/position_query.h"

namespace axlecast {
namespace {

using db::Parameter;
using nlohmann::ordered_json;

constexpr std::size_t kMinutesShown = 5;  // that differ, of a device
constexpr std::size_t kDamageShown = 5;   // stretches without a hole

// The times of the log's rows: partitions outside need not be read.
QueryTimes TimesOf(const FleetLog& log) {
  if (log.first_utime == 0) return {};
  return {.from = log.first_utime, .until = log.last_utime + 1};
}

// Appends a difference between two numbers.
void CompareNumbers(const char* name, std::int64_t in_log, std::int64_t in_database,
                    std::vector<std::string>& differences) {
  if (in_log == in_database) return;
  differences.push_back(std::string(name) + ": the log has " + std::to_string(in_log) + ", the database " +
                        std::to_string(in_database));
}

void CompareContent(const std::string& device, const PositionDigest& log, const PositionDigest& database,
                    std::vector<std::string>& differences) {
  const std::vector<MinuteDifference> minutes = DifferencesOf(log, database);
  for (std::size_t i = 0; i < std::min(minutes.size(), kMinutesShown); ++i) {
    const MinuteDifference& minute = minutes[i];
    differences.push_back(device + ", minute " + UtcText(minute.utime) + ": the log has " +
                          std::to_string(minute.in_log) + " samples, the database " +
                          std::to_string(minute.in_database) +
                          (minute.in_log == minute.in_database ? ", with other values" : ""));
  }
  if (minutes.size() > kMinutesShown) {
    differences.push_back(device + ": " + std::to_string(minutes.size()) + " minutes differ");
  }
}

void CompareDamage(const std::vector<std::int64_t>& unexplained, std::vector<std::string>& differences) {
  for (std::size_t i = 0; i < std::min(unexplained.size(), kDamageShown); ++i) {
    differences.push_back("the log is damaged from the event " + std::to_string(unexplained[i]) +
                          " on, and the database has no hole there");
  }
  if (unexplained.size() > kDamageShown)
    differences.push_back(std::to_string(unexplained.size()) + " damaged stretches are not holes in the database");
}

const char* DetailText(Detail detail) {
  if (detail >= Detail::kSamples) return "";
  return detail == Detail::kNone ? "; not from this log" : "; not compared, because ship.detail reduces them";
}

// Returns which of a device's two channels the database has: the one that is equal, else the one whose number is closer.
const PositionDigest& ShippedOf(const DevicePositions& log, const DatabasePositions& database, bool content) {
  const auto distance = [&](const PositionDigest& digest) {
    const std::int64_t difference = digest.samples() - database.samples;
    return difference < 0 ? -difference : difference;
  };
  if (content && DifferencesOf(log.blocks, database.digest).empty()) return log.blocks;
  if (content && DifferencesOf(log.positions, database.digest).empty()) return log.positions;
  return distance(log.blocks) < distance(log.positions) ? log.blocks : log.positions;
}

}  // namespace

Result<std::optional<FleetLog>> FindLog(FleetReader& reader, const FleetMachine& machine, const LogKey& key) {
  const auto logs = reader.Logs(machine);
  if (!logs) return Failure(logs.error());
  const auto found = std::ranges::find_if(*logs, [&](const FleetLog& log) {
    return log.name == key.name && log.host == key.host && log.start_utime == key.start_utime &&
           log.file_number == key.file_number;
  });
  return found == logs->end() ? std::nullopt : std::optional(*found);
}

Result<std::vector<OddEvent>> ReadOddEvents(FleetReader& reader, const FleetLog& log) {
  std::vector<OddEvent> odd;
  const auto done = reader.ForEach("SELECT event, message FROM axlecast.odd WHERE log = $1 ORDER BY event",
                                   {Parameter::Int(log.id)}, [&](const db::Rows& row) {
                                     const std::string message = row.Binary(0, 1).value_or("");
                                     odd.push_back({row.Int(0, 0).value_or(0), Crc32c(0, AsBytes(message))});
                                     return true;
                                   });
  if (!done) return Failure(done.error());
  return odd;
}

Result<std::vector<LogGap>> ReadGaps(FleetReader& reader, const FleetLog& log) {
  std::vector<LogGap> gaps;
  const auto done = reader.ForEach(
      "SELECT first_event, messages FROM axlecast.hole WHERE log = $1 AND first_event IS NOT NULL ORDER BY "
      "first_event",
      {Parameter::Int(log.id)}, [&](const db::Rows& row) {
        gaps.push_back({row.Int(0, 0).value_or(0), row.Int(0, 1).value_or(-1)});
        return true;
      });
  if (!done) return Failure(done.error());
  return gaps;
}

Result<DatabaseDevices> ReadSampleCounts(FleetReader& reader, const FleetMachine& machine, const FleetLog& log) {
  const QueryTimes times = TimesOf(log);
  const auto rows = reader.database().Query(
      "SELECT d.name, sum(c.n)::int8 FROM axlecast.device d JOIN axlecast.stream s ON s.device = d.id"
      " JOIN axlecast.position_chunk c ON c.stream = s.id"
      " WHERE d.machine = $1 AND c.log = $2 AND c.t0 >= $3 AND c.t0 < $4 GROUP BY d.name",
      {Parameter::Int(machine.id), Parameter::Int(log.id), Parameter::Timestamp(times.from.value_or(INT64_MIN)),
       Parameter::Timestamp(times.until.value_or(INT64_MAX))});
  if (!rows) return Failure(rows.error());
  DatabaseDevices devices;
  for (int row = 0; row < rows->size(); ++row) {
    devices[std::string(rows->Text(row, 0))].samples = rows->Int(row, 1).value_or(0);
  }
  return devices;
}

Result<DatabaseDevices> ReadDigests(FleetReader& reader, const FleetMachine& machine, const FleetLog& log) {
  const QueryTimes times = TimesOf(log);
  const auto names = reader.Devices(machine, "");
  if (!names) return Failure(names.error());
  DatabaseDevices devices;
  for (const FleetDevice& device : *names) {
    const auto streams = ChunkStreams(reader, device, times);
    if (!streams) return Failure(streams.error());
    for (const FleetStream& stream : *streams) {
      const auto done = ForEachChunk(reader, stream, times, log.id, [&](const PositionChunkRow& chunk) {
        DatabasePositions& positions = devices[device.name];
        positions.samples += chunk.summary.n;
        const auto samples = DecodePositionChunk(chunk, stream.key);
        if (!samples) {
          ++positions.damaged;
          return true;
        }
        for (const PositionSample& sample : *samples)
          positions.digest.Add(sample.utime, sample.counts, sample.flags);
        return true;
      });
      if (!done) return Failure(done.error());
    }
  }
  return devices;
}

std::map<std::string, Detail> ShippedDetails(const MachineConfig& machine, const std::string& log,
                                             const std::map<std::string, DevicePositions>& devices) {
  const LogFacts facts = LogFactsOf(machine);
  ChannelChooser chooser(facts, log, DetailRulesOf(machine.ship).value_or(DetailRules()));
  std::map<std::string, Detail> details;
  for (const auto& [name, positions] : devices) {
    details[name] = std::max(chooser.Of(facts.prefix + "POSITION/" + name).detail.detail,
                             chooser.Of(facts.prefix + "POSITION_BLOCK/" + name).detail.detail);
  }
  return details;
}

LogComparison Compare(const LogComparisonInput& input) {
  LogComparison result;
  result.events = input.log.events();
  result.remaining = input.log.remaining();
  result.gaps = input.log.gaps();
  result.missing = input.log.missing();
  result.content = input.content;
  CompareDamage(input.log.unexplained(), result.differences);
  CompareNumbers("number of the last event", input.log.next(), input.ledger.upto, result.differences);
  CompareNumbers("bytes", static_cast<std::int64_t>(input.log.bytes()), input.ledger.bytes, result.differences);
  CompareNumbers("CRC-32C of the seals", input.log.chain(), input.ledger.chain, result.differences);
  CompareNumbers("odd messages that are not in the log", 0, input.log.wrong_odd(), result.differences);
  if (input.complete && result.remaining > 0) {
    result.differences.push_back(std::to_string(result.remaining) + " events are not in the database yet");
  }
  std::map<std::string, DevicePositions> devices = input.log.devices();
  for (const auto& [name, positions] : input.database) devices.try_emplace(name);
  for (const auto& [name, of_log] : devices) {
    const auto found = input.database.find(name);
    const DatabasePositions of_database = found == input.database.end() ? DatabasePositions() : found->second;
    const PositionDigest& shipped = ShippedOf(of_log, of_database, input.content);
    const auto known = input.details.find(name);
    const Detail detail = known == input.details.end() ? Detail::kNone : known->second;
    result.devices.push_back({name, shipped.samples(), of_database.samples, detail});
    CompareNumbers((name + ", chunks that cannot be decoded").c_str(), 0, of_database.damaged, result.differences);
    if (detail == Detail::kNone)
      CompareNumbers((name + ", samples from this log").c_str(), 0, of_database.samples, result.differences);
    if (detail < Detail::kSamples) continue;
    CompareNumbers((name + ", samples").c_str(), shipped.samples(), of_database.samples, result.differences);
    if (input.content) CompareContent(name, shipped, of_database.digest, result.differences);
  }
  return result;
}

std::string ComparisonText(const std::string& file, const LogComparison& comparison) {
  std::string text = file + ": " + (comparison.differences.empty() ? "equal" : "DIFFERENT") + ", " +
                     std::to_string(comparison.events) + " events";
  if (comparison.remaining > 0)
    text += ", " + std::to_string(comparison.remaining) + " are not in the database yet";
  if (comparison.gaps > 0) {
    text += ", " + std::to_string(comparison.gaps) + " damaged stretches with " +
            std::to_string(comparison.missing) + " messages are holes in the database";
  }
  text += comparison.content ? "\n" : "; the content was not compared (--quick)\n";
  for (const LogComparison::Device& device : comparison.devices) {
    text += "  " + Left(device.name, 24) + ' ' + Right(std::to_string(device.in_log), 12) +
            " samples in the log, " + Right(std::to_string(device.in_database), 12) + " in the database" +
            DetailText(device.detail) + '\n';
  }
  for (const std::string& difference : comparison.differences) text += "  different: " + difference + '\n';
  return text;
}

ordered_json ComparisonJson(const std::string& file, const LogComparison& comparison) {
  ordered_json devices = ordered_json::array();
  for (const LogComparison::Device& device : comparison.devices) {
    devices.push_back({{"device", device.name},
                       {"samples_in_log", device.in_log},
                       {"samples_in_database", device.in_database},
                       {"compared", device.detail >= Detail::kSamples}});
  }
  return {{"file", file},
          {"equal", comparison.differences.empty()},
          {"events", comparison.events},
          {"remaining", comparison.remaining},
          {"holes", comparison.gaps},
          {"missing", comparison.missing},
          {"content", comparison.content},
          {"devices", devices},
          {"differences", comparison.differences}};
}

}  // namespace axlecast
