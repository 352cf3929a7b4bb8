#include "tools/axlecast/logs/record.h"

#include <algorithm>
#include <array>
#include <nlohmann/json.hpp>

#include "core/base/text.h"
#include "core/messages/json/field.h"
#include "tools/axlecast/common/terminal.h"
#include "tools/recorder/recording_health.h"

namespace axlecast {
namespace {

constexpr std::size_t kShown = 8;  // maximum number of senders and of channels in the summary

// Returns, for example, "3.3 h".
std::string DurationText(double seconds) {
  if (seconds < 120) return Decimal(seconds, 0) + " s";
  if (seconds < 7'200) return Decimal(seconds / 60, 0) + " min";
  if (seconds < 172'800) return Decimal(seconds / 3'600, 1) + " h";
  return Decimal(seconds / 86'400, 0) + " days";
}

const char* StateText(std::int8_t state) {
  switch (state) {
    case recorder_health_t::STATE_PRE_TRIGGER:
      return "waiting ";
    case recorder_health_t::STATE_DISK_FULL:
      return "DISK FULL ";
    case recorder_health_t::STATE_ERROR:
      return "ERROR ";
    default:
      return "";
  }
}

std::string Count(std::int64_t count, const char* what) { return std::to_string(count) + ' ' + what; }

// Returns the number of datagrams that the kernel dropped, and whose gap no later message has revealed.
std::int64_t Undetected(const RecordingStatus& status) {
  return std::max<std::int64_t>(status.receiver.kernel_dropped - status.receiver.lost, 0);
}

std::string LossLines(const RecordingStatus& status) {
  std::string text;
  const ReceiverCounts& counts = status.receiver;
  if (counts.lost > 0) text += "  " + Count(counts.lost, "missing by the senders' sequence numbers\n");
  if (counts.overflow > 0)
    text += "  " + Count(counts.overflow, "found no space in memory (--buffer): the disk is slow\n");
  if (status.unwritten > 0) text += "  " + Count(status.unwritten, "not written to the disk\n");
  if (counts.kernel_dropped > 0) {
    text +=
        "  " + Count(counts.kernel_dropped, "datagrams dropped by the kernel (recv_buf_size, net.core.rmem_max)\n");
  }
  if (Undetected(status) > 0) {
    text +=
        "  of these at least " + Count(Undetected(status), "from senders without a message after (or before)\n");
  }
  return text;
}

nlohmann::ordered_json SenderJson(const SenderCount& sender) {
  return {{"sender", SenderText(sender.sender)},
          {"received", sender.received},
          {"lost", sender.lost},
          {"repeated", sender.repeated}};
}

// Returns, for example, "12.3 MB".
std::string ByteText(double bytes) {
  constexpr std::array<const char*, 5> kUnits = {"B", "kB", "MB", "GB", "TB"};
  std::size_t unit = 0;
  for (; bytes >= 1'000 && unit + 1 < kUnits.size(); ++unit) bytes /= 1'000;
  return Decimal(bytes, unit == 0 ? 0 : 1) + ' ' + kUnits[unit];
}

}  // namespace

std::string RecordStatusLine(const recorder_health_t& health) {
  std::string line = StateText(health.state);
  line += Decimal(static_cast<double>(health.messages_hz), 0) + " messages/s  ";
  line += ByteText(static_cast<double>(health.bytes_hz)) + "/s  ";
  line += Count(health.messages, "messages") + ", " + ByteText(static_cast<double>(health.total_bytes));
  line += "  lost " + std::to_string(health.lost);
  if (health.kernel_dropped > 0) line += " (kernel " + std::to_string(health.kernel_dropped) + ')';
  line += "  free " + ByteText(static_cast<double>(health.free_bytes));
  if (health.bytes_hz > 1) {
    line +=
        " (" + DurationText(static_cast<double>(health.free_bytes) / static_cast<double>(health.bytes_hz)) + ')';
  }
  return line;
}

std::string RecordSummary(const RecordingStatus& status) {
  std::string text = Count(status.messages, "messages, ") + ByteText(static_cast<double>(status.bytes)) +
                     (status.disk.file.empty() ? "" : ", last in " + status.disk.file) + '\n';
  if (!status.failure.empty()) text += "ended early: " + status.failure + '\n';
  if (status.disk.damaged || status.unwritten > 0) text += status.disk.last_error + '\n';
  if (status.early > 0) {
    text += "the pre-trigger memory was full: " + Count(status.early, "messages were removed early\n");
  }
  if (status.IsComplete()) return text + "nothing was lost\n";
  text += "LOST:\n" + LossLines(status);
  const auto& senders = status.receiver.senders;
  for (std::size_t i = 0; i < std::min(senders.size(), kShown) && senders[i].lost > 0; ++i) {
    text += "  " + Left(SenderText(senders[i].sender), 22) + Count(senders[i].lost, "lost, ") +
            Count(senders[i].received, "received\n");
  }
  for (std::size_t i = 0; i < std::min(status.channels.size(), kShown); ++i) {
    const ChannelLoss& channel = status.channels[i];
    text += "  " + Left(Printable(channel.channel), 22) + Count(channel.lost, "lost, ") +
            Count(channel.received, "recorded\n");
  }
  return text;
}

std::string RecordEndJson(const std::string& name, const RecordingStatus& status) {
  nlohmann::ordered_json json = {{"kind", "end"},
                                 {"name", name},
                                 {"whole", status.IsComplete() && !status.HasFailed()},
                                 {"file", status.disk.file},
                                 {"messages", status.messages},
                                 {"bytes", status.bytes},
                                 {"lost", status.Lost()},
                                 {"lost_by_number", status.receiver.lost},
                                 {"lost_in_memory", status.receiver.overflow},
                                 {"lost_at_disk", status.unwritten},
                                 {"kernel_dropped", status.receiver.kernel_dropped},
                                 {"foreign", status.receiver.not_lcm},
                                 {"left_memory_early", status.early},
                                 {"error", status.failure.empty() ? status.disk.last_error : status.failure}};
  json["senders"] = nlohmann::ordered_json::array();
  for (const SenderCount& sender : status.receiver.senders) json["senders"].push_back(SenderJson(sender));
  json["channels"] = nlohmann::ordered_json::array();
  for (const ChannelLoss& channel : status.channels) {
    json["channels"].push_back(
        {{"channel", channel.channel}, {"received", channel.received}, {"lost", channel.lost}});
  }
  return JsonLine(json);
}

int RecordExitCode(const RecordingStatus& status) {
  if (status.HasFailed()) return kExitFailed;
  return status.IsComplete() ? kExitDone : kExitLosses;
}

}  // namespace axlecast
