#include "tools/fleet/read/raw_query.h"

#include <nlohmann/json.hpp>
#include <optional>
#include <utility>

#include "core/base/inline_bytes.h"
#include "tools/fleet/raw_records.h"

namespace axlecast {
namespace {

using db::Parameter;

constexpr int kRowsAtOnce = 4;  // a row has the records of about one second

}  // namespace

Result<RawCoverage> ReadCoverage(FleetReader& reader, const FleetLog& log) {
  RawCoverage coverage;
  const auto done = reader.ForEach("SELECT first_event, n FROM axlecast.raw WHERE log = $1 ORDER BY first_event",
                                   {Parameter::Int(log.id)}, [&](const db::Rows& row) {
                                     coverage.Add(row.Int(0, 0).value_or(0), row.Int(0, 1).value_or(0));
                                     return true;
                                   });
  if (!done) return Failure(done.error());
  return coverage;
}

Result<std::string> ReadMachineFile(FleetReader& reader, const FleetLog& log) {
  const auto rows = reader.database().Query(
      "SELECT f.text FROM axlecast.log l JOIN axlecast.machine_file f ON f.machine = l.machine AND f.sha256 = "
      "l.machine_file WHERE l.id = $1",
      {Parameter::Int(log.id)});
  if (!rows) return Failure(rows.error());
  return std::string(rows->Text(0, 0));
}

FetchedHead HeadOf(const FleetLog& log, std::string machine_file) {
  const nlohmann::ordered_json recorder = {{"version", "fetched from the fleet database"},
                                           {"name", log.name},
                                           {"host", log.host},
                                           {"urls", nlohmann::ordered_json::array()},
                                           {"channel", ""},
                                           {"invert", false},
                                           {"start_utime", log.start_utime},
                                           {"file_number", log.file_number}};
  return {.utime = log.start_utime,
          .recorder = recorder.dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace),
          .machine = std::move(machine_file)};
}

Result<> RawLane::Advance() {
  at_end_ = true;
  for (;;) {
    while (NextRecord()) {
      if (!times_.Contains(event_.utime)) continue;
      at_end_ = false;
      return {};
    }
    if (rows_.empty()) {
      if (Result<> fetched = Fetch(); !fetched) return fetched;
      if (rows_.empty()) return {};
    }
    const RawRow row = std::move(rows_.front());
    rows_.pop_front();
    offset_ = 0;
    records_.clear();
    auto records = DecodeRaw(row);
    if (records) {
      records_ = *std::move(records);
    } else {
      damaged_.push_back({.log = logs_[log_].file,
                          .first_event = row.first_event,
                          .n = row.n,
                          .t0 = row.t0,
                          .t1 = row.t1,
                          .why = records.error().text});
    }
  }
}

Result<> RawLane::Fetch() {
  for (; log_ < logs_.size(); ++log_, after_ = -1) {
    const auto rows = reader_.database().Query(
        "SELECT first_event, n, t0, t1, crc32c, records FROM axlecast.raw WHERE log = $1 AND first_event > $2"
        " AND greatest(t0, t1) >= $3 AND least(t0, t1) < $4 ORDER BY first_event LIMIT " +
            std::to_string(kRowsAtOnce),
        {Parameter::Int(logs_[log_].id), Parameter::Int(after_),
         Parameter::Timestamp(times_.from.value_or(INT64_MIN)),
         Parameter::Timestamp(times_.until.value_or(INT64_MAX))});
    if (!rows) return Failure(rows.error());
    for (int row = 0; row < rows->size(); ++row) {
      const std::string records = rows->Binary(row, 5).value_or("");
      rows_.push_back({.first_event = rows->Int(row, 0).value_or(0),
                       .n = rows->Int(row, 1).value_or(0),
                       .t0 = rows->Timestamp(row, 2).value_or(0),
                       .t1 = rows->Timestamp(row, 3).value_or(0),
                       .crc32c = static_cast<std::uint32_t>(rows->Int(row, 4).value_or(0)),
                       .records = {records.begin(), records.end()}});
    }
    if (!rows_.empty()) {
      after_ = rows_.back().first_event;
      return {};
    }
  }
  return {};
}

bool RawLane::NextRecord() {
  if (offset_ >= records_.size()) return false;
  const auto event = ParseEvent(Bytes(records_).subspan(offset_));
  if (!event) return false;  // DecodeRaw has checked the records
  offset_ += EventSize(*event);
  event_ = *event;
  return true;
}

}  // namespace axlecast
