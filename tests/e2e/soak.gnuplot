# The picture of a soak: gnuplot -e "folder='...'" soak.gnuplot
set terminal svg size 1200,1000 font "Inter,12" background "white"
set output folder . "/soak.svg"
set datafile separator ","
set multiplot layout 5,1 margins 0.09,0.98,0.05,0.97 spacing 0,0.03
set key off
set grid
csv = folder . "/soak.csv"
unset xlabel
set format x ""
set yrange [0:*]
set ylabel "valid readings/s"
last_s = 0; last_valid = 0
rate(s, valid) = (r = s > last_s ? (valid - last_valid) / (s - last_s) : 0, last_s = s, last_valid = valid, r)
plot csv using 1:(rate($1, $2)) with lines
set ylabel "lost readings"
plot csv using 1:3 with lines
set ylabel "memory, MB"
plot csv using 1:($4 / 1000) with lines
set ylabel "open files"
plot csv using 1:5 with lines
set ylabel "threads"
set format x "%g"
set xlabel "s"
plot csv using 1:6 with lines
unset multiplot
