#include "tools/axlecast/logs/log_output.h"

#include <string_view>
#include <utility>

#include "core/base/result.h"
#include "tools/log/log_event.h"

namespace axlecast {
namespace {

constexpr std::size_t kBuffer = 1U << 20;
constexpr std::int64_t kSealUs = 1'000'000;  // as the recorder does
constexpr std::uint64_t kSealBytes = 16U << 20;

}  // namespace

LogOutput::LogOutput(std::string path, mode_t mode) : file_(std::move(path), {.mode = mode}) {
  buffer_.reserve(2 * kBuffer);
}

void LogOutput::Add(const LogEvent& event) {
  if (event.channel == kSealChannel) return;
  if (IsLogChannel(event.channel) &&
      !headers_.emplace(event.channel, std::vector(event.data.begin(), event.data.end())).second) {
    return;
  }
  if (events_ == 0) sealed_ = event.utime;
  ++events_;
  Write(event);
  const std::uint64_t since = static_cast<std::uint64_t>(utime_) - static_cast<std::uint64_t>(sealed_);
  if (since >= kSealUs || count_.seal().bytes >= kSealBytes) Seal();
}

void LogOutput::Write(const LogEvent& event) {
  LogEvent numbered = event;
  numbered.number = number_++;
  const std::size_t begin = buffer_.size();
  AppendEvent(buffer_, numbered);
  utime_ = event.utime;
  if (event.channel != kSealChannel) count_.Add(Bytes(buffer_).subspan(begin));
  if (buffer_.size() >= kBuffer) Flush();
}

void LogOutput::Seal() {
  const std::vector<std::uint8_t> data = EncodeSeal(count_.seal());
  Write({.utime = utime_, .channel = kSealChannel, .data = data});
  count_.Reset();
  sealed_ = utime_;
}

void LogOutput::Flush() {
  if (state_) state_ = file_.Append({reinterpret_cast<const char*>(buffer_.data()), buffer_.size()});
  buffer_.clear();
}

Result<> LogOutput::Commit(bool replace) {
  if (count_.seal().events > 0) Seal();
  Flush();
  return state_ ? file_.Commit(replace) : state_;
}

}  // namespace axlecast
