#include "tools/mqtt/link_frames.h"

#include <cstring>

namespace axlecast {
namespace {

void Put(std::string& body, std::uint32_t number) {
  body.append(reinterpret_cast<const char*>(&number), sizeof number);
}

void Put(std::string& body, std::string_view text) {
  Put(body, static_cast<std::uint32_t>(text.size()));
  body += text;
}

std::string Framed(std::string_view body) {
  std::string frame;
  Put(frame, body);
  return frame;
}

class Reader {
 public:
  explicit Reader(std::string_view body) : rest_(body) {}

  std::uint32_t Number() {
    std::uint32_t number = 0;
    if (rest_.size() < sizeof number) {
      good_ = false;
      return 0;
    }
    std::memcpy(&number, rest_.data(), sizeof number);
    rest_.remove_prefix(sizeof number);
    return number;
  }

  std::string Text() {
    const std::uint32_t size = Number();
    if (!good_ || size > rest_.size()) {
      good_ = false;
      return "";
    }
    std::string text(rest_.substr(0, size));
    rest_.remove_prefix(size);
    return text;
  }

  bool Flag() { return Number() != 0; }
  [[nodiscard]] bool AtGoodEnd() const { return good_ && rest_.empty(); }

 private:
  std::string_view rest_;
  bool good_ = true;
};

void Put(std::string& body, const MqttLinkSettings& settings) {
  Put(body, settings.host);
  Put(body, static_cast<std::uint32_t>(settings.port));
  Put(body, std::uint32_t{settings.version_5});
  Put(body, settings.client_id);
  Put(body, settings.user);
  Put(body, settings.password.file);
  Put(body, settings.password.credential);
  Put(body, std::uint32_t{settings.password.group_may_read});
  Put(body, std::uint32_t{settings.tls});
  Put(body, settings.ca);
  Put(body, settings.certificate);
  Put(body, settings.key);
  Put(body, static_cast<std::uint32_t>(settings.keep_alive_s));
  Put(body, settings.attempts);
}

MqttLinkSettings TakeSettings(Reader& reader) {
  MqttLinkSettings settings;
  settings.host = reader.Text();
  settings.port = static_cast<int>(reader.Number());
  settings.version_5 = reader.Flag();
  settings.client_id = reader.Text();
  settings.user = reader.Text();
  settings.password.file = reader.Text();
  settings.password.credential = reader.Text();
  settings.password.group_may_read = reader.Flag();
  settings.tls = reader.Flag();
  settings.ca = reader.Text();
  settings.certificate = reader.Text();
  settings.key = reader.Text();
  settings.keep_alive_s = static_cast<int>(reader.Number());
  settings.attempts = reader.Number();
  return settings;
}

}  // namespace

std::string EncodeOrder(const LinkOrder& order) {
  std::string body;
  Put(body, static_cast<std::uint32_t>(order.kind));
  if (order.kind == LinkOrder::Kind::kConnect) Put(body, order.settings);
  if (order.kind != LinkOrder::Kind::kDisconnect) {
    Put(body, static_cast<std::uint32_t>(order.id));
    Put(body, order.message.topic);
    Put(body, order.message.payload);
    Put(body, std::uint32_t{order.message.retain});
  }
  return Framed(body);
}

std::optional<LinkOrder> DecodeOrder(std::string_view body) {
  Reader reader(body);
  LinkOrder order;
  const std::uint32_t kind = reader.Number();
  if (kind > static_cast<std::uint32_t>(LinkOrder::Kind::kDisconnect)) return std::nullopt;
  order.kind = static_cast<LinkOrder::Kind>(kind);
  if (order.kind == LinkOrder::Kind::kConnect) order.settings = TakeSettings(reader);
  if (order.kind != LinkOrder::Kind::kDisconnect) {
    order.id = static_cast<std::int32_t>(reader.Number());
    order.message.topic = reader.Text();
    order.message.payload = reader.Text();
    order.message.retain = reader.Flag();
  }
  return reader.AtGoodEnd() ? std::optional(order) : std::nullopt;
}

std::string EncodeEvent(const BrokerEvent& event) {
  std::string body;
  Put(body, static_cast<std::uint32_t>(event.kind));
  Put(body, static_cast<std::uint32_t>(event.message));
  Put(body, event.text);
  Put(body, std::uint32_t{event.fault});
  return Framed(body);
}

std::optional<BrokerEvent> DecodeEvent(std::string_view body) {
  Reader reader(body);
  BrokerEvent event;
  const std::uint32_t kind = reader.Number();
  if (kind > static_cast<std::uint32_t>(BrokerEvent::Kind::kDown)) return std::nullopt;
  event.kind = static_cast<BrokerEvent::Kind>(kind);
  event.message = static_cast<int>(reader.Number());
  event.text = reader.Text();
  event.fault = reader.Flag();
  return reader.AtGoodEnd() ? std::optional(event) : std::nullopt;
}

std::optional<std::string> FrameBuffer::Next() {
  std::uint32_t size = 0;
  if (bad_ || bytes_.size() < sizeof size) return std::nullopt;
  std::memcpy(&size, bytes_.data(), sizeof size);
  bad_ = size > longest_;
  if (bad_ || bytes_.size() - sizeof size < size) return std::nullopt;
  std::string body = bytes_.substr(sizeof size, size);
  bytes_.erase(0, sizeof size + size);
  return body;
}

}  // namespace axlecast
