#include "tests/campaign/campaign_main.h"

#include <algorithm>
#include <cstdlib>

#include "core/config/load.h"

namespace axlecast {

bool CampaignOrder::Wants(std::string_view mode) const {
  return modes.empty() || std::find(modes.begin(), modes.end(), mode) != modes.end();
}

std::optional<CampaignOrder> ReadCampaignOrder(int argc, char** argv, const char* usage) {
  const std::int64_t count = argc > 1 ? std::atoll(argv[1]) : 0;
  if (count <= 0) {
    std::fprintf(stderr, "usage: %s\n", usage);
    return std::nullopt;
  }
  return CampaignOrder{.count = count, .modes = {argv + 2, argv + argc}};
}

std::optional<MachineConfig> CampaignMachine(const std::string& text) {
  ConfigErrors errors("campaign");
  std::optional<MachineConfig> machine = ParseConfig(text, errors);
  if (!machine) std::fputs(errors.Text().c_str(), stderr);
  return machine;
}

}  // namespace axlecast
