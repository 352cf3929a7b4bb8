#include "tools/convert/conversion.h"

#include <axlecast/position_tracker.h>

#include <algorithm>
#include <array>
#include <axlecast/device_info_t.hpp>
#include <axlecast/position_t.hpp>
#include <charconv>
#include <cmath>
#include <deque>
#include <limits>
#include <map>
#include <optional>
#include <string_view>
#include <system_error>

#include "core/base/text.h"
#include "core/messages/json/message_json.h"
#include "core/messages/message.h"

namespace axlecast {
namespace {

bool IsNumber(std::string_view cell) {
  double value = 0;
  const auto [end, error] = std::from_chars(cell.data(), cell.data() + cell.size(), value);
  return error == std::errc() && end == cell.data() + cell.size();
}

// Detects the cells that OWASP's "CSV Injection" lists.
bool IsFormula(std::string_view cell) {
  constexpr std::string_view kBeginnings = "=+-@\t\r";
  return !cell.empty() && kBeginnings.find(cell.front()) != std::string_view::npos && !IsNumber(cell);
}

void AppendQuoted(std::string& line, std::string_view cell) {
  if (cell.find_first_of(",\"\r\n") == std::string_view::npos) {
    line += cell;
    return;
  }
  line += '"';
  for (const char c : cell) {
    if (c == '"') line += '"';
    line += c;
  }
  line += '"';
}

// The columns by name, in the order of their first occurrence.
class Columns {
 public:
  Columns() {
    Add("log_utime");
    Add("channel");
  }
  void Add(const std::string& name) {
    if (places_.emplace(name, names_.size()).second) names_.push_back(name);
  }
  [[nodiscard]] const std::vector<std::string>& names() const { return names_; }
  [[nodiscard]] std::size_t Place(const std::string& name) const { return places_.at(name); }

 private:
  std::vector<std::string> names_;
  std::map<std::string, std::size_t> places_;
};

Columns FindColumns(const EventRange& events) {
  Columns columns;
  std::map<std::string_view, bool> same;  // by type of message: all messages have the same fields
  events([&](const LogEvent& event) {
    const MessageType* const type = FindMessageType(event.data);
    if (type == nullptr) return true;
    const auto seen = same.find(type->name);
    if (seen != same.end() && seen->second) return true;
    const auto message = type->decode(event.data);
    if (!message) return true;
    VisitFields(*message, [&](const std::string& name, const auto&) { columns.Add(name); });
    if (seen == same.end()) same[type->name] = AlwaysSameFields(type->schema);
    return true;
  });
  return columns;
}

std::string CellText(const nlohmann::ordered_json& value) {
  if (value.is_null()) return "";
  return value.is_string() ? value.get<std::string>() : value.dump();
}

constexpr std::int64_t kMaxRows = 100'000'000;
constexpr std::int64_t kMaxWaitUs = 10'000'000;  // of a row for a channel that sends nothing
constexpr std::size_t kMaxWaitingRows = 100'000;
constexpr std::int64_t kNsPerMicrosecond = 1'000;

// The first DEVICE message of each driver process of a device, by boot id.
using DeviceByBoot = std::map<std::int64_t, device_info_t>;

// The cells of one channel in one row. Unknown values are empty.
struct Cell {
  std::optional<double> value;        // in the device's unit
  std::optional<double> counts;       // interpolated
  std::optional<std::int32_t> flags;  // of the last reading, if it is not older than the maximum age
};

// Interpolates the positions of one device at the times of the grid.
class GridChannel {
 public:
  GridChannel(std::size_t number, const TimeGrid& grid, const DeviceByBoot& devices)
      : number_(number),
        period_us_(grid.period_us),
        max_age_us_(MaxAge(grid.max_age_us, devices)),
        devices_(devices),
        tracker_({.max_extrapolation_ns = 0,
                  .max_gap_ns = max_age_us_ * kNsPerMicrosecond,
                  .instant = PositionTracker::Options::Instant::kGiven}) {}

  // Calls set(index, cell) for the rows from the previous reading up to this one. `index`: UNIX time in grid periods.
  template <typename Set>
  void On(const position_t& position, const Set& set) {
    constexpr std::int64_t kLatestUs = INT64_MAX / kNsPerMicrosecond / 2;  // in 2116; ns must not overflow
    const std::int64_t at = position.utime;
    if (at < 0 || at > kLatestUs) return;
    const PositionTracker::News news = tracker_.OnPosition(position, at * kNsPerMicrosecond);
    if (!before_ || news.restarted) {
      before_.reset();
      const auto device = devices_.find(position.boot_id);
      if (device != devices_.end()) tracker_.OnDevice(device->second);
    }
    if (!news.used) return;
    if (before_) {
      std::int64_t index = before_->utime / period_us_ + 1;
      for (; index * period_us_ < at && index * period_us_ - before_->utime <= max_age_us_; ++index) {
        set(index, At(index * period_us_, before_->flags));
      }
    }
    if (at % period_us_ == 0) set(at / period_us_, At(at, position.flags));
    before_ = position;
  }
  [[nodiscard]] std::size_t number() const { return number_; }

 private:
  static std::int64_t MaxAge(std::int64_t option_us, const DeviceByBoot& devices) {
    constexpr std::int64_t kDefaultUs = 50'000;
    if (option_us > 0) return option_us;
    const auto limited =
        std::find_if(devices.begin(), devices.end(), [](const auto& d) { return d.second.max_age_us > 0; });
    return limited == devices.end() ? kDefaultUs : limited->second.max_age_us;
  }
  [[nodiscard]] Cell At(std::int64_t unix_us, std::int32_t flags) const {
    const PositionTracker::Position position = tracker_.At(unix_us * kNsPerMicrosecond);
    Cell cell{.value = {}, .counts = {}, .flags = flags};
    if (!position) return cell;
    cell.counts = position.counts;
    if (!std::isnan(position.value)) cell.value = position.value;
    return cell;
  }

  std::size_t number_;
  std::int64_t period_us_;
  std::int64_t max_age_us_;
  const DeviceByBoot& devices_;
  PositionTracker tracker_;
  std::optional<position_t> before_;
};

// Returns "DEVICE/axis1" for "POSITION/axis1", also after a prefix.
std::string DeviceChannel(std::string_view position_channel) {
  constexpr std::string_view kPosition = "POSITION/";
  const std::size_t at = position_channel.rfind(kPosition);
  if (at == std::string_view::npos) return "";
  return std::string(position_channel.substr(0, at)) + "DEVICE/" +
         std::string(position_channel.substr(at + kPosition.size()));
}

std::string Number(double value) {
  std::array<char, 400> text{};  // the longest double without an exponent has 327 characters
  const auto [end, error] = std::to_chars(text.data(), text.data() + text.size(), value, std::chars_format::fixed);
  return error == std::errc() ? std::string(text.data(), end) : "";
}

// Result of the first pass over the log.
struct Survey {
  std::map<std::string, DeviceByBoot, std::less<>> channels;  // of positions
  std::int64_t first_us = std::numeric_limits<std::int64_t>::max();
  std::int64_t last_us = std::numeric_limits<std::int64_t>::min();

  [[nodiscard]] std::string Header() const {
    std::vector<std::string> names = {"utime"};
    for (const auto& [channel, devices] : channels) {
      for (const char* field : {":value", ":counts", ":flags"}) names.push_back(channel + field);
    }
    return CsvLine(names);
  }
  [[nodiscard]] std::string Note() const {
    std::string note;
    for (const auto& [channel, devices] : channels) {
      if (devices.empty()) note += (note.empty() ? "" : ", ") + channel;
    }
    return note.empty() ? "" : note + ": no value, because the log contains no DEVICE message; counts are written";
  }
};

Survey SurveyPositions(const EventRange& events, const EventRange& all) {
  Survey survey;
  events([&](const LogEvent& event) {
    const auto position = DecodeMessage<position_t>(event.data);
    if (!position) return true;
    survey.channels.try_emplace(std::string(event.channel));
    survey.first_us = std::min(survey.first_us, position->utime);
    survey.last_us = std::max(survey.last_us, position->utime);
    return true;
  });
  std::map<std::string, DeviceByBoot*, std::less<>> devices;
  for (auto& [channel, device] : survey.channels) devices[DeviceChannel(channel)] = &device;
  all([&](const LogEvent& event) {
    const auto device = devices.find(event.channel);
    if (device == devices.end()) return true;
    const auto info = DecodeMessage<device_info_t>(event.data);
    if (info) device->second->try_emplace(info->boot_id, *info);
    return true;
  });
  return survey;
}

// Buffers rows until all channels have passed them, and writes them in order.
class Rows {
 public:
  Rows(std::int64_t first, std::int64_t period_us, std::size_t channels, const Output& out)
      : next_(first), period_us_(period_us), reached_(channels, first), out_(out) {}

  void Set(std::size_t channel, std::int64_t index, const Cell& cell) {
    if (index < next_) return;
    while (static_cast<std::int64_t>(waiting_.size()) <= index - next_ && good_) {
      if (waiting_.size() >= kMaxWaitingRows) WriteFirst();
      waiting_.emplace_back(reached_.size());
    }
    if (!good_) return;
    waiting_[static_cast<std::size_t>(index - next_)][channel] = cell;
    reached_[channel] = index;
    newest_ = std::max(newest_, index);
    const std::int64_t complete = *std::min_element(reached_.begin(), reached_.end());
    while (!waiting_.empty() && good_ && (next_ < complete || (newest_ - next_) * period_us_ > kMaxWaitUs)) {
      WriteFirst();
    }
  }
  void WriteRest() {
    while (!waiting_.empty() && good_) WriteFirst();
  }
  [[nodiscard]] std::int64_t written() const { return written_; }
  [[nodiscard]] bool good() const { return good_; }

 private:
  void WriteFirst() {
    std::vector<std::string> texts = {std::to_string(next_ * period_us_)};
    for (const Cell& cell : waiting_.front()) {
      texts.push_back(cell.value ? Number(*cell.value) : "");
      texts.push_back(cell.counts ? Number(*cell.counts) : "");
      texts.push_back(cell.flags ? std::to_string(*cell.flags) : "");
    }
    waiting_.pop_front();
    ++next_;
    ++written_;
    good_ = out_(CsvLine(texts));
  }

  std::int64_t next_;  // index of the first row in waiting_
  std::int64_t period_us_;
  std::vector<std::int64_t> reached_;  // index of each channel's last row
  std::int64_t newest_ = 0;
  std::deque<std::vector<Cell>> waiting_;
  const Output& out_;
  std::int64_t written_ = 0;
  bool good_ = true;  // the output has taken everything
};

}  // namespace

void AppendCsvCell(std::string& line, std::string_view cell) {
  constexpr std::string_view kReplacement = "\xEF\xBF\xBD";
  std::string text = MendedUtf8(cell);
  for (std::size_t at = 0; (at = text.find('\0', at)) != std::string::npos; at += kReplacement.size()) {
    text.replace(at, 1, kReplacement);
  }
  AppendQuoted(line, IsFormula(text) ? '\'' + text : text);
}

std::string CsvLine(const std::vector<std::string>& cells) {
  std::string line;
  for (std::size_t i = 0; i < cells.size(); ++i) {
    if (i > 0) line += ',';
    AppendCsvCell(line, cells[i]);
  }
  return line + "\r\n";
}

Conversion WriteCsvTable(const EventRange& events, const Output& out) {
  Conversion done;
  const Columns columns = FindColumns(events);
  if (!out(CsvLine(columns.names()))) return done;
  std::vector<std::string> cells;
  events([&](const LogEvent& event) {
    std::string type;
    const auto message = DecodeToJson(event.data, &type);
    if (!message) {
      ++done.left_out;
      return true;
    }
    cells.assign(columns.names().size(), "");
    VisitFields(*message,
                [&](const std::string& name, const auto& value) { cells[columns.Place(name)] = CellText(value); });
    cells[0] = std::to_string(event.utime);
    cells[1] = event.channel;
    ++done.written;
    return out(CsvLine(cells));
  });
  return done;
}

Result<Conversion> WriteCsvGrid(const EventRange& events, const EventRange& all, const TimeGrid& grid,
                                const Output& out) {
  const Survey survey = SurveyPositions(events, all);
  if (survey.channels.empty()) {
    return Failure("the selected events contain no position; a time grid is made from POSITION channels");
  }
  if (survey.first_us < 0 || survey.last_us / grid.period_us - survey.first_us / grid.period_us > kMaxRows) {
    return Failure(
        "the times of the positions span more than 100,000,000 rows: choose a longer --grid, or --from and "
        "--until");
  }
  std::map<std::string, GridChannel, std::less<>> channels;
  for (const auto& [name, devices] : survey.channels) {
    channels.emplace(name, GridChannel(channels.size(), grid, devices));
  }
  Conversion done{.note = survey.Note()};
  if (!out(survey.Header())) return done;
  const std::int64_t first = survey.first_us / grid.period_us + (survey.first_us % grid.period_us == 0 ? 0 : 1);
  Rows rows(first, grid.period_us, channels.size(), out);
  events([&](const LogEvent& event) {
    const auto position = DecodeMessage<position_t>(event.data);
    if (position) {
      GridChannel& channel = channels.find(event.channel)->second;
      channel.On(*position, [&](std::int64_t index, const Cell& cell) { rows.Set(channel.number(), index, cell); });
    } else {
      ++done.left_out;
    }
    return rows.good();
  });
  rows.WriteRest();
  done.written = rows.written();
  return done;
}

}  // namespace axlecast
