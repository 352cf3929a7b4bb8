#pragma once

#include <cstdint>
#include <cstdio>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/config/machine_config.h"

namespace axlecast {

// PROGRAM COUNT [MODE...]
struct CampaignOrder {
  std::int64_t count = 0;          // > 0, in each mode
  std::vector<std::string> modes;  // none: all

  [[nodiscard]] bool Wants(std::string_view mode) const;
};

// Prints the usage if there is no mode.
[[nodiscard]] std::optional<CampaignOrder> ReadCampaignOrder(int argc, char** argv, const char* usage);

// Prints what is wrong with the text.
[[nodiscard]] std::optional<MachineConfig> CampaignMachine(const std::string& text);

// Runs the modes that are ordered; run(mode, count) prints the figures of one and returns whether they are in order.
// Prints `verdict` when all are. Returns the exit status: 0, 1 when a mode failed, 2 after the usage
// or without a mode of those names.
template <typename Modes, typename Run>
int CampaignMain(int argc, char** argv, const char* usage, const char* verdict, const Modes& modes, Run run) {
  const std::optional<CampaignOrder> order = ReadCampaignOrder(argc, argv, usage);
  if (!order) return 2;
  bool good = true;
  bool any = false;
  for (const auto& mode : modes) {
    if (!order->Wants(mode.name)) continue;
    any = true;
    good = run(mode, order->count) && good;
    std::fflush(stdout);
  }
  if (!any) {
    std::fprintf(stderr, "no such mode; usage: %s\n", usage);
    return 2;
  }
  std::printf("%s\n", good ? verdict : "FAILED");
  return good ? 0 : 1;
}

}  // namespace axlecast
