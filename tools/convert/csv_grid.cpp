#include "tools/convert/csv_grid.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <deque>
#include <limits>
#include <map>
#include <string>
#include <vector>

#include "core/messages/message.h"
#include "tools/convert/csv_line.h"
#include "tools/convert/grid_channel.h"

namespace axlecast {
namespace {

constexpr std::int64_t kMaxRows = 100'000'000;
constexpr std::int64_t kWaitUs = 10'000'000;  // rows wait so long for a channel that is silent
constexpr std::size_t kMaxWaiting = 100'000;

// "DEVICE/axis1" of "POSITION/axis1", behind any prefix.
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

// What is known before the first row.
struct Survey {
  std::map<std::string, DeviceByBoot, std::less<>> channels;  // of positions
  std::int64_t first = std::numeric_limits<std::int64_t>::max();
  std::int64_t last = std::numeric_limits<std::int64_t>::min();
};

Survey Look(const EventRange& events, const EventRange& all) {
  Survey survey;
  events([&](const LogEvent& event) {
    const auto position = DecodeMessage<position_t>(event.data);
    if (!position) return true;
    survey.channels.try_emplace(std::string(event.channel));
    survey.first = std::min(survey.first, position->utime);
    survey.last = std::max(survey.last, position->utime);
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

// Rows that are not yet complete, in order.
class Rows {
 public:
  Rows(std::int64_t first, std::int64_t period_us, std::size_t channels, const Output& out)
      : next_(first), period_us_(period_us), reached_(channels, first), out_(out) {}

  void Set(std::size_t channel, std::int64_t index, const GridChannel::Cell& cell) {
    if (index < next_) return;
    while (static_cast<std::int64_t>(waiting_.size()) <= index - next_ && good_) {
      if (waiting_.size() >= kMaxWaiting) WriteFirst();
      waiting_.emplace_back(reached_.size());
    }
    if (!good_) return;
    waiting_[static_cast<std::size_t>(index - next_)][channel] = cell;
    reached_[channel] = index;
    newest_ = std::max(newest_, index);
    const std::int64_t complete = *std::min_element(reached_.begin(), reached_.end());
    while (!waiting_.empty() && good_ && (next_ < complete || (newest_ - next_) * period_us_ > kWaitUs))
      WriteFirst();
  }
  void WriteRest() {
    while (!waiting_.empty() && good_) WriteFirst();
  }
  [[nodiscard]] std::int64_t written() const { return written_; }
  [[nodiscard]] bool good() const { return good_; }

 private:
  void WriteFirst() {
    std::vector<std::string> texts = {std::to_string(next_ * period_us_)};
    for (const GridChannel::Cell& cell : waiting_.front()) {
      texts.push_back(cell.value ? Number(*cell.value) : "");
      texts.push_back(cell.counts ? Number(*cell.counts) : "");
      texts.push_back(cell.flags ? std::to_string(*cell.flags) : "");
    }
    waiting_.pop_front();
    ++next_;
    ++written_;
    good_ = out_(CsvLine(texts));
  }

  std::int64_t next_;  // of the first row that waits
  std::int64_t period_us_;
  std::vector<std::int64_t> reached_;  // by each channel
  std::int64_t newest_ = 0;
  std::deque<std::vector<GridChannel::Cell>> waiting_;
  const Output& out_;
  std::int64_t written_ = 0;
  bool good_ = true;
};

std::string Header(const Survey& survey) {
  std::vector<std::string> names = {"utime"};
  for (const auto& [channel, devices] : survey.channels) {
    for (const char* field : {":value", ":counts", ":flags"}) names.push_back(channel + field);
  }
  return CsvLine(names);
}

std::string Note(const Survey& survey) {
  std::string note;
  for (const auto& [channel, devices] : survey.channels) {
    if (!devices.empty()) continue;
    note += (note.empty() ? "" : ", ") + channel;
  }
  return note.empty() ? "" : note + ": no value, because the log holds no DEVICE message of it; counts are there";
}

}  // namespace

Conversion WriteCsvGrid(const EventRange& events, const EventRange& all, const TimeGrid& grid, const Output& out) {
  const Survey survey = Look(events, all);
  Conversion done;
  if (survey.channels.empty()) {
    done.problem = "no position is among these events: a time grid is made of POSITION channels";
    return done;
  }
  if (survey.first < 0 || survey.last / grid.period_us - survey.first / grid.period_us > kMaxRows) {
    done.problem =
        "the positions' times span more than 100,000,000 rows: choose a longer --grid, or --from and --until";
    return done;
  }
  struct Channel {
    std::size_t number;
    GridChannel positions;
  };
  std::map<std::string, Channel, std::less<>> channels;
  for (const auto& [name, devices] : survey.channels) {
    channels.emplace(name, Channel{channels.size(), GridChannel(grid.period_us, grid.max_age_us, devices)});
  }
  if (!out(Header(survey))) return done;
  const std::int64_t first = survey.first / grid.period_us + (survey.first % grid.period_us == 0 ? 0 : 1);
  Rows rows(first, grid.period_us, channels.size(), out);
  events([&](const LogEvent& event) {
    const auto position = DecodeMessage<position_t>(event.data);
    if (position) {
      Channel& channel = channels.find(event.channel)->second;
      channel.positions.On(*position, [&](std::int64_t index, const GridChannel::Cell& cell) {
        rows.Set(channel.number, index, cell);
      });
    } else {
      ++done.left_out;
    }
    return rows.good();
  });
  rows.WriteRest();
  done.written = rows.written();
  done.note = Note(survey);
  return done;
}

}  // namespace axlecast
