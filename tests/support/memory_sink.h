#pragma once

#include <string>
#include <utility>
#include <vector>

#include "core/messages/message.h"

namespace axlecast {

// Keeps every published message.
class MemorySink final : public MessageSink {
 public:
  void Publish(const std::string& channel, Bytes message) override {
    messages_.emplace_back(channel, std::vector<std::uint8_t>(message.begin(), message.end()));
  }

  // The messages of one channel, decoded, in order.
  template <typename Message>
  [[nodiscard]] std::vector<Message> All(const std::string& channel) const {
    std::vector<Message> found;
    for (const auto& [name, bytes] : messages_) {
      if (name != channel) continue;
      if (auto message = DecodeMessage<Message>(bytes)) found.push_back(std::move(*message));
    }
    return found;
  }
  // The same, as they were published.
  [[nodiscard]] std::vector<std::vector<std::uint8_t>> Messages(const std::string& channel) const {
    std::vector<std::vector<std::uint8_t>> found;
    for (const auto& [name, bytes] : messages_) {
      if (name == channel) found.push_back(bytes);
    }
    return found;
  }
  [[nodiscard]] std::size_t size() const { return messages_.size(); }
  void Clear() { messages_.clear(); }

 private:
  std::vector<std::pair<std::string, std::vector<std::uint8_t>>> messages_;
};

}  // namespace axlecast
