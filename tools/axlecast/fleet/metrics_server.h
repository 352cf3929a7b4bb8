#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "core/base/result.h"
#include "core/config/listen_address.h"

namespace axlecast {

// Serves until it is destroyed.
class MetricsServer {
 public:
  virtual ~MetricsServer() = default;
};

// Serves `metrics` over HTTP on a thread of its own, which calls the function at each request. `names`: those of this host that a request
// may contain, besides its addresses and localhost. Starts no thread if it fails: the address cannot be served, or the program is built
// without AXLECAST_WEB. Signals must be blocked before. One in a process.
[[nodiscard]] Result<std::unique_ptr<MetricsServer>> StartMetricsServer(const ListenAddress& listen,
                                                                        std::vector<std::string> names,
                                                                        std::function<std::string()> metrics);

}  // namespace axlecast
