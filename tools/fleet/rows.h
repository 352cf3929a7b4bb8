#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <tuple>
#include <vector>

namespace axlecast {

// Rows of the fleet database (docs/fleet.md), as plain values. Times are us, UNIX time, within the range that the composer
// received, unless a comment permits others. Texts are valid UTF-8 without NUL. `message` is the whole message as JSON
// (core/messages/json), which PostgreSQL accepts as jsonb.

// The times that the database accepts, in us, UNIX time: first <= t < end.
struct UtimeRange {
  std::int64_t first = 0;
  std::int64_t end = 0;

  [[nodiscard]] bool Contains(std::int64_t utime) const { return utime >= first && utime < end; }
};

// The positions of one device whose counts can be compared with each other. A row refers to it by its index in BatchRows.
struct StreamKey {
  std::string device = {};
  std::int64_t boot_id = 0;
  std::int32_t datum_epoch = 0;
  std::int64_t counts_per_turn = 0;
  std::int8_t unit = 0;                       // position_t UNIT_*
  std::optional<double> unit_per_count = {};  // finite; without `modulo`; nothing: unknown

  [[nodiscard]] auto Fields() const {
    return std::tie(device, boot_id, datum_epoch, counts_per_turn, unit, unit_per_count);
  }
  friend bool operator==(const StreamKey& a, const StreamKey& b) { return a.Fields() == b.Fields(); }
  friend bool operator<(const StreamKey& a, const StreamKey& b) { return a.Fields() < b.Fields(); }
};

// What several samples have in common. lo, hi and mean are of the samples with FLAG_VALID only. Without such a sample they are
// empty (NULL). `mean` is to be weighted by `valid` where rows are joined.
struct SampleSummary {
  std::optional<std::int64_t> lo = {};
  std::optional<std::int64_t> hi = {};
  std::optional<double> mean = {};
  std::int64_t n = 0;       // samples, at least 1; at most 256 in a chunk
  std::int64_t valid = 0;   // of them with FLAG_VALID
  std::int64_t missed = 0;  // sum of position_t.missed (of the blocks), limited to INT32_MAX
  std::int32_t flags_or = 0;
  std::int32_t flags_and = 0;

  friend bool operator==(const SampleSummary&, const SampleSummary&) = default;
};

struct PositionChunkRow {
  std::int64_t t0 = 0;     // of the first sample
  std::int64_t t1 = 0;     // of the last sample
  std::int64_t seq0 = 0;   // position_t.seq (of a block: position_block_t.seq) of the first sample
  std::int64_t first = 0;  // counts of the first sample, valid or not
  std::int64_t last = 0;   // counts of the last sample, valid or not
  SampleSummary summary;
  std::size_t stream = 0;  // index in BatchRows::streams
  std::vector<std::uint8_t> body = {};
};

// Part of one second or minute. A batch has at most one row of a stream and time; the database joins the rows of several batches.
struct RollUpRow {
  std::int64_t t = 0;  // begin of the second or minute
  SampleSummary summary;
  std::size_t stream = 0;
};

enum class AlarmChange : std::uint8_t { kAppeared, kChanged, kCleared };
[[nodiscard]] const char* AlarmChangeName(AlarmChange change);  // "appeared", "changed", "cleared"

// One transition of an alarm. Unique: (device, boot_id, source, code, first_utime, change, t). A repeated row is equal.
struct AlarmRow {
  std::int64_t t = 0;  // kAppeared: first_utime if it is in the range of times; else: of the message that shows it
  std::string device = {};  // the rest of the channel's name: a device, bridge, recorder/NAME, mqtt/NAME
  std::int64_t boot_id = 0;
  std::int32_t code = 0;
  std::string name = {};
  std::int8_t source = 0;    // alarm_entry_t SOURCE_*
  std::int8_t severity = 0;  // alarm_entry_t SEVERITY_*
  std::int8_t state = 0;     // alarm_entry_t STATE_*; kCleared: the last one
  AlarmChange change = AlarmChange::kAppeared;
  std::string text = {};         // the action for the operator
  std::int64_t first_utime = 0;  // any time, as the message has it
  std::int64_t last_utime = 0;   // any time, as the message has it
  std::int32_t count = 0;
  std::string
      cause;  // kCleared: empty, or "restarted": a new boot_id publishes the channel, and nobody cleared the alarm
  std::string message = {};  // the alarm_entry_t
  std::int64_t event = 0;    // its number in the log
};

// A final outcome of a command, a finding after it, or the command itself. Unique: (id, state, finding).
struct FleetCommandRow {
  std::int64_t t = 0;
  std::string device = {};
  std::array<std::uint8_t, 16> id{};
  std::string operation = {};
  std::string state = {};    // "succeeded" ...: StateName; "issued", "prepare_issued", "commit_issued",
                             // "cancel_issued": the command as its client sent it
  std::string finding = {};  // FindingName; empty without a finding
  bool verified = false;
  std::int32_t reason_code = 0;
  std::string reason = {};          // ReasonName; of "issued": the text that the client stated
  std::string text = {};            // for an operator
  std::string issued_by = {};       // "issued": key_id as 16 hex digits; empty: unsigned
  std::int64_t boot_id = 0;         // of the bridge, or of the client
  std::int64_t seq = 0;             // of the message that came first
  std::int64_t started_utime = 0;   // any time; 0: not started
  std::int64_t finished_utime = 0;  // any time; 0: not finished
  std::string message = {};         // command_status_t, or command_body_t of "issued"
  std::int64_t event = 0;           // its number in the log
};

// A trip of a motor. Unique: (device, identity).
struct TripRow {
  std::int64_t t = 0;  // when it was read
  std::string device = {};
  std::int64_t identity =
      0;  // hash of trip_count, factor_bits and the curves: equal if the log is read or sent again
  std::int64_t boot_id = 0;
  std::int32_t trip_count = 0;
  std::int32_t factor_bits = 0;       // motor_health_t STATUS_*
  std::int64_t not_before_utime = 0;  // any time; 0: unknown
  std::int64_t not_after_utime = 0;   // any time; 0: unknown
  std::int32_t interval_us = 0;       // between the samples of the curves
  std::string message = {};
  std::int64_t event = 0;  // its number in the log
};

// Health: at most one row of a channel in each 10 s (of t), and one for each change of its state. Unique: (name, t, boot_id, seq).
struct DeviceHealthRow {
  std::int64_t t = 0;
  std::string device = {};
  std::int64_t boot_id = 0;
  std::int64_t seq = 0;
  std::int8_t state = 0;  // device_info_t STATE_*
  std::string bus = {};
  std::string family = {};
  std::string model = {};
  std::string serial = {};
  std::string firmware = {};
  std::string reason = {};
  std::int32_t datum_epoch = 0;
  bool reference_lost = false;
  std::int64_t good = 0;
  std::array<std::int64_t, 16> errors{};  // device_info_t ERROR_*
  std::int32_t nv_writes = 0;
  std::int64_t last_good_utime = 0;  // any time; 0: never
  std::string message = {};
  std::int64_t event = 0;  // its number in the log
};

struct BusHealthRow {
  std::int64_t t = 0;
  std::string bus = {};
  std::int64_t boot_id = 0;
  std::int64_t seq = 0;
  std::int8_t state = 0;  // bus_health_t STATE_*
  std::string family = {};
  std::string port = {};
  std::int64_t exchanges = 0;
  std::int64_t good = 0;
  std::array<std::int64_t, 16> errors{};  // device_info_t ERROR_*
  std::int64_t late = 0;
  std::int64_t rx_dropped = 0;
  std::optional<double> rate_hz = {};      // nothing: unknown
  std::optional<double> utilisation = {};  // nothing: unknown
  std::int32_t reopens = 0;
  std::string last_error = {};
  std::string message = {};
  std::int64_t event = 0;  // its number in the log
};

struct RecorderHealthRow {
  std::int64_t t = 0;
  std::string recorder = {};
  std::int64_t boot_id = 0;
  std::int64_t seq = 0;
  std::int8_t state = 0;  // recorder_health_t STATE_*
  std::string file = {};
  std::int64_t messages = 0;
  std::int64_t lost = 0;
  std::int64_t kernel_dropped = 0;
  std::int64_t free_bytes = 0;
  std::string last_error = {};
  std::string message = {};
  std::int64_t event = 0;  // its number in the log
};

struct MotorHealthRow {
  std::int64_t t = 0;
  std::string device = {};
  std::int64_t boot_id = 0;
  std::int64_t seq = 0;
  std::optional<double> voltage_v = {};  // nothing: unknown, as of the others
  std::optional<double> current_a = {};
  std::optional<double> power_w = {};
  std::optional<double> temperature_c = {};
  std::array<std::optional<double>, 3> accel_mps2 = {};
  std::int32_t trip_count = 0;
  std::int32_t status_bits = 0;  // motor_health_t STATUS_*
  std::int32_t flags = 0;        // motor_health_t FLAG_*
  std::string message = {};
  std::int64_t event = 0;  // its number in the log
};

// What a host knows about the time base, from TIME/<host>.
struct ClockRow {
  std::int64_t t = 0;
  std::string host = {};
  std::string root = {};  // the host whose clock is the base
  std::int64_t boot_id = 0;
  std::int64_t seq = 0;
  std::int8_t state = 0;   // time_quality_t STATE_*
  std::int8_t grade = 0;   // time_quality_t GRADE_*
  std::int8_t source = 0;  // time_quality_t SOURCE_*
  std::int64_t base_id = 0;
  std::int32_t epoch = 0;
  std::int64_t half_width_ns = 0;  // -1: no claim
  std::int8_t utc_grade = 0;
  std::int64_t utc_half_width_ns = 0;  // -1: no claim
  std::string reason = {};
  std::string message = {};
  std::int64_t event = 0;  // its number in the log
};

// The machine's file as a log's head has it. Unique: sha256.
struct MachineFileRow {
  std::array<std::uint8_t, 32> sha256{};  // of the bytes in the log
  std::string text = {};
  std::int64_t first_seen = 0;  // when the event was received, limited to the range of times
};

// Records of a log, unchanged: those of the channels with `raw`. tools/fleet/raw_records.h decodes them.
struct RawRow {
  std::int64_t first_event = 0;            // number of the first record
  std::int64_t n = 0;                      // records
  std::int64_t t0 = 0;                     // reception of the first record, limited to the range of times
  std::int64_t t1 = 0;                     // reception of the last record, limited to the range of times
  std::uint32_t crc32c = 0;                // of the records before compression
  std::vector<std::uint8_t> records = {};  // compressed with zstd
};

// Messages of one channel and publisher whose numbers follow each other without a gap, as a log has them.
struct ReceivedRun {
  std::string channel;  // as in the log
  std::int64_t boot_id = 0;
  std::int64_t first_seq = 0;
  std::int64_t last_seq = 0;
  std::int64_t t0 = 0;  // reception of the first message
  std::int64_t t1 = 0;  // reception of the last message

  friend bool operator==(const ReceivedRun&, const ReceivedRun&) = default;
};

// A message that no other table can hold.
struct OddRow {
  std::int64_t event = 0;  // its number in the log
  std::string channel = {};
  std::int64_t utime = 0;     // of the message; any time; 0: it cannot be decoded
  std::int64_t received = 0;  // any time
  std::string cause = {};     // OddCause... in row_composer.h
  std::vector<std::uint8_t> message = {};
};

// Every event is counted in exactly one field.
struct EventCounts {
  std::int64_t stored = 0;       // in at least one row other than roll-ups
  std::int64_t rolled_up = 0;    // positions that are in the rows of seconds and minutes only
  std::int64_t repeated = 0;     // repeats what was stored before, or shows a state that has not changed
  std::int64_t excluded = 0;     // by `detail`, by the choice of the log, or of no interest to the database
  std::int64_t odd = 0;          // in OddRow
  std::int64_t bookkeeping = 0;  // of the log itself: seals and heads

  [[nodiscard]] std::int64_t Total() const { return stored + rolled_up + repeated + excluded + odd + bookkeeping; }
  friend bool operator==(const EventCounts&, const EventCounts&) = default;
};

// The rows of one batch, which go to the database in one transaction.
struct BatchRows {
  // Returns the index of the stream in `streams`; adds it if it is missing.
  [[nodiscard]] std::size_t IndexOf(const StreamKey& stream) {
    const auto [place, is_new] = stream_index.try_emplace(stream, streams.size());
    if (is_new) streams.push_back(stream);
    return place->second;
  }

  std::map<StreamKey, std::size_t> stream_index = {};
  std::vector<StreamKey> streams = {};
  std::vector<PositionChunkRow> chunks = {};
  std::vector<RollUpRow> seconds = {};
  std::vector<RollUpRow> minutes = {};
  std::vector<AlarmRow> alarms = {};
  std::vector<FleetCommandRow> commands = {};
  std::vector<TripRow> trips = {};
  std::vector<DeviceHealthRow> devices = {};
  std::vector<BusHealthRow> buses = {};
  std::vector<RecorderHealthRow> recorders = {};
  std::vector<MotorHealthRow> motors = {};
  std::vector<ClockRow> clocks = {};
  std::vector<MachineFileRow> machine_files = {};
  std::vector<RawRow> raw = {};
  std::vector<OddRow> odd = {};
  std::vector<ReceivedRun> received = {};

  EventCounts counts;
  std::int64_t samples = 0;      // of positions, in chunks
  std::int64_t raw_events = 0;   // in `raw`; they are counted in `counts` as well
  std::int64_t first_utime = 0;  // of the messages with rows; 0: none
  std::int64_t last_utime = 0;
};

}  // namespace axlecast
