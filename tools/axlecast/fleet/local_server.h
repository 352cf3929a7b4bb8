#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "core/base/result.h"
#include "platform/os/folder.h"
#include "platform/os/process.h"
#include "tools/axlecast/common/program.h"
#include "tools/axlecast/run/process_supervisor.h"

namespace axlecast {

struct LocalServerSettings {
  std::string folder;  // absolute; made if it is missing
  std::string user;    // the server's processes run as this user; empty: as this process
  int port = 0;        // also on 127.0.0.1; 0: only on the Unix socket in the folder
};

// A PostgreSQL server of the host's package (/usr/lib/postgresql/*/bin) with its data in a folder of its own. It ends with this
// process, also if that is killed. Use it on the main thread.
class LocalServer {
 public:
  explicit LocalServer(LocalServerSettings settings);
  ~LocalServer();
  LocalServer(const LocalServer&) = delete;
  LocalServer& operator=(const LocalServer&) = delete;

  // Makes the folder and, in a new one, the data; then starts the server. It accepts connections a little later.
  [[nodiscard]] Result<> Start(const StopSignal& stop);
  // Writes the server's messages to its log. Fails if the server has ended.
  [[nodiscard]] Result<> Poll();
  // Waits until the server's process has ended: connections are closed, and the data is on disk. A further request of `stop` ends it at
  // once; it recovers at its next start.
  void Stop(const StopSignal& stop);

  // Returns the connection string, without a database.
  [[nodiscard]] std::string Connection() const;
  [[nodiscard]] const std::string& log() const { return log_path_; }

 private:
  [[nodiscard]] std::string SocketPath() const;
  [[nodiscard]] Result<> PrepareFolder();
  [[nodiscard]] Result<> FindPrograms();
  [[nodiscard]] Result<> CreateData(const StopSignal& stop);
  [[nodiscard]] Result<> RemoveRests(const StopSignal& stop) const;
  [[nodiscard]] std::vector<std::string> AsUser(std::vector<std::string> argv) const;
  void CopyLog();

  LocalServerSettings settings_;
  std::string data_;
  std::string log_path_;
  std::string programs_;  // folder with initdb and postgres
  LockFile lock_;
  std::unique_ptr<ProcessLog> log_;
  std::string last_line_;
  ChildProcess process_;
};

}  // namespace axlecast
