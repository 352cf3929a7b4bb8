#include "tools/mqtt/link_frames.h"

#include <cstring>

namespace axlecast {
namespace {

// Appends fields to a body. A number has 32 bits; a text is its size and its bytes.
class Writer {
 public:
  void operator()(std::uint32_t number) { body_.append(reinterpret_cast<const char*>(&number), sizeof number); }
  void operator()(int number) { (*this)(static_cast<std::uint32_t>(number)); }
  void operator()(bool flag) { (*this)(std::uint32_t{flag}); }
  void operator()(const std::string& text) {
    (*this)(static_cast<std::uint32_t>(text.size()));
    body_ += text;
  }
  template <typename Kind>
  void Choice(Kind kind, Kind) {
    (*this)(static_cast<std::uint32_t>(kind));
  }

  // Returns the size and the body.
  [[nodiscard]] std::string Frame() const {
    Writer frame;
    frame(body_);
    return frame.body_;
  }

 private:
  std::string body_;
};

// Reads the fields of a body. After a field that is incomplete or out of range, all further fields stay unchanged.
class Reader {
 public:
  explicit Reader(std::string_view body) : rest_(body) {}

  void operator()(std::uint32_t& number) {
    good_ = good_ && rest_.size() >= sizeof number;
    if (!good_) return;
    std::memcpy(&number, rest_.data(), sizeof number);
    rest_.remove_prefix(sizeof number);
  }
  void operator()(int& number) { number = static_cast<int>(Number()); }
  void operator()(bool& flag) { flag = Number() != 0; }
  void operator()(std::string& text) {
    const std::uint32_t size = Number();
    good_ = good_ && size <= rest_.size();
    if (!good_) return;
    text = rest_.substr(0, size);
    rest_.remove_prefix(size);
  }
  template <typename Kind>
  void Choice(Kind& kind, Kind last) {
    const std::uint32_t number = Number();
    good_ = good_ && number <= static_cast<std::uint32_t>(last);
    if (good_) kind = static_cast<Kind>(number);
  }

  [[nodiscard]] bool AtGoodEnd() const { return good_ && rest_.empty(); }

 private:
  std::uint32_t Number() {
    std::uint32_t number = 0;
    (*this)(number);
    return number;
  }

  std::string_view rest_;
  bool good_ = true;
};

// The following functions list each field once, for both directions: `take` is a Writer or a Reader.

template <typename Taker, typename Settings>
void VisitSettings(Taker& take, Settings& settings) {
  take(settings.host);
  take(settings.port);
  take(settings.version_5);
  take(settings.client_id);
  take(settings.user);
  take(settings.password.file);
  take(settings.password.credential);
  take(settings.password.group_may_read);
  take(settings.tls);
  take(settings.ca);
  take(settings.certificate);
  take(settings.key);
  take(settings.keep_alive_s);
  take(settings.attempts);
}

template <typename Taker, typename Command>
void VisitCommand(Taker& take, Command& command) {
  take.Choice(command.kind, LinkCommand::Kind::kDisconnect);
  if (command.kind == LinkCommand::Kind::kConnect) VisitSettings(take, command.settings);
  if (command.kind == LinkCommand::Kind::kDisconnect) return take(command.publish_will);
  take(command.id);
  take(command.message.topic);
  take(command.message.payload);
  take(command.message.retain);
  take(command.message.qos);
}

template <typename Taker, typename Event>
void VisitEvent(Taker& take, Event& event) {
  take.Choice(event.kind, BrokerEvent::Kind::kDown);
  take(event.message);
  take(event.text);
  take(event.fault);
  take(event.topic);
  take(event.retained);
  take(event.taken_over);
}

}  // namespace

std::string EncodeCommand(const LinkCommand& command) {
  Writer writer;
  VisitCommand(writer, command);
  return writer.Frame();
}

std::optional<LinkCommand> DecodeCommand(std::string_view body) {
  Reader reader(body);
  LinkCommand command;
  VisitCommand(reader, command);
  return reader.AtGoodEnd() ? std::optional(command) : std::nullopt;
}

std::string EncodeEvent(const BrokerEvent& event) {
  Writer writer;
  VisitEvent(writer, event);
  return writer.Frame();
}

std::optional<BrokerEvent> DecodeEvent(std::string_view body) {
  Reader reader(body);
  BrokerEvent event;
  VisitEvent(reader, event);
  return reader.AtGoodEnd() ? std::optional(event) : std::nullopt;
}

std::optional<std::string> FrameBuffer::Next() {
  std::uint32_t size = 0;
  if (bad_ || bytes_.size() < sizeof size) return std::nullopt;
  std::memcpy(&size, bytes_.data(), sizeof size);
  bad_ = size > maximum_;
  if (bad_ || bytes_.size() - sizeof size < size) return std::nullopt;
  std::string body = bytes_.substr(sizeof size, size);
  bytes_.erase(0, sizeof size + size);
  return body;
}

}  // namespace axlecast
