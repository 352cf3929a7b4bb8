import java.io.EOFException;
import java.io.PrintStream;
import java.nio.charset.StandardCharsets;
import java.util.zip.CRC32;
import lcm.logging.Log;

/**
 * Prints each event of a log as LCM's Java library reads it: time, channel in hex, size and CRC-32 of the data. The library skips
 * events without data, and says so on standard output, which is standard error here.
 */
public class ReadLog {
  public static void main(String[] arguments) throws Exception {
    PrintStream result = System.out;
    System.setOut(System.err);
    Log log = new Log(arguments[0], "r");
    StringBuilder out = new StringBuilder();
    try {
      while (true) {
        Log.Event event = log.readNext();
        CRC32 crc = new CRC32();
        crc.update(event.data);
        out.append(event.utime).append(' ');
        for (byte b : event.channel.getBytes(StandardCharsets.UTF_8)) out.append(String.format("%02x", b));
        out.append(' ').append(event.data.length).append(' ').append(crc.getValue()).append('\n');
      }
    } catch (EOFException end) {
      result.print(out);
    }
  }
}
