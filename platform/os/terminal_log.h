#pragma once

#include <spdlog/sinks/stdout_color_sinks.h>

#include <string>

#include "core/base/text.h"

namespace axlecast {

// The sink of spdlog on standard error, with lines that cannot control the terminal.
class TerminalLogSink final : public spdlog::sinks::stderr_color_sink_mt {
 public:
  void log(const spdlog::details::log_msg& message) override {
    const std::string text = TerminalText({message.payload.data(), message.payload.size()});
    spdlog::details::log_msg safe = message;
    safe.payload = text;
    spdlog::sinks::stderr_color_sink_mt::log(safe);
  }
};

}  // namespace axlecast
