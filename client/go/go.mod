module axlecast

go 1.19
