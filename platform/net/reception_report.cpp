#include "platform/net/reception_report.h"

namespace axlecast {
namespace {

void Add(std::string& text, std::int64_t count, const std::string& what) {
  if (count == 0) return;
  if (!text.empty()) text += "; ";
  text += std::to_string(count) + (count == 1 ? " datagram " : " datagrams ") + what;
}

}  // namespace

ReceptionCounts& ReceptionCounts::operator+=(const ReceptionCounts& other) {
  messages += other.messages;
  dropped += other.dropped;
  outside += other.outside;
  malformed += other.malformed;
  return *this;
}

std::string ReceptionText(const ReceptionCounts& counts, const std::string& remedy) {
  std::string text;
  Add(text, counts.dropped, "lost because this process's receive buffer was full");
  if (counts.dropped > 0 && !remedy.empty()) text += " (" + remedy + ")";
  Add(text, counts.outside, "from other hosts refused, because the URL says ttl=0");
  Add(text, counts.malformed, "refused that LCM did not make");
  return text.empty() ? "" : "LCM since the start: " + text;
}

std::string ReceptionReport::Next(const ReceptionCounts& counts, MonoNs now, const std::string& remedy) {
  if (!Changed(counts) || now < next_) return "";
  next_ = now + kInterval;
  reported_ = counts;
  return ReceptionText(counts, remedy);
}

}  // namespace axlecast
