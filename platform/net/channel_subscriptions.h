#pragma once

#include <cstdint>
#include <functional>
#include <regex>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/inline_bytes.h"

namespace axlecast {

// Who is to be called for which channels. Which patterns match a name is remembered for the newest names, in a table of
// fixed size: a name that falls out of it costs time, never a message. One thread.
class ChannelSubscriptions {
 public:
  using Handler = std::function<void(const std::string& channel, Bytes message)>;
  static constexpr std::size_t kRememberedNames = 1'024;

  // `prefix` is put before every pattern as text, and taken off the names that handlers see.
  explicit ChannelSubscriptions(std::string prefix) : prefix_(std::move(prefix)) {}

  // `pattern` is a regular expression (ECMAScript) over the whole name behind the prefix. False when it is none.
  bool Add(const std::string& pattern, Handler handler);

  // Calls every handler whose pattern matches, in the order in which they were added. Returns their number.
  std::size_t Dispatch(std::string_view channel, Bytes message);

  [[nodiscard]] bool empty() const { return subscriptions_.empty(); }
  [[nodiscard]] std::size_t memory() const;  // bytes of the remembered names, about

 private:
  struct Subscription {
    std::regex pattern;
    Handler handler;
  };
  struct Remembered {
    std::string channel;                  // with the prefix; empty: nothing yet
    std::string name;                     // without it
    std::vector<std::uint16_t> matching;  // in subscriptions_
  };

  const Remembered& Find(std::string_view channel);

  std::string prefix_;
  std::vector<Subscription> subscriptions_;
  std::vector<Remembered> remembered_;  // by the name's hash
};

}  // namespace axlecast
