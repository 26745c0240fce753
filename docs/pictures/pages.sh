# Makes the runs behind report.png, fleet.png and viewer.png, and takes the first two; in an empty folder.
# For viewer.png open `urdyn view cell-7 --twin model/twin.toml`, halt it at 66 s and zoom in.
set -e
arm="--robot ur5e --seed 5"
urdyn simulate $arm --duration 20 --rate 100 --out first.parquet
urdyn identify first.parquet --robot ur5e --out model
urdyn simulate $arm --run 3 --duration 80 --rate 50 --fault friction_increase:joint=2,onset=20,rate=0.012 --out weld.parquet
urdyn simulate $arm --run 4 --duration 80 --rate 50 --fault health_degradation:joint=1,onset=30,rate=0.12,shape=step --out pack.parquet
urdyn simulate $arm --run 1 --duration 30 --rate 100 --fault friction_increase:joint=2,onset=5,rate=0.02 --out day.parquet
urdyn simulate $arm --run 2 --duration 40 --rate 100 --out monday.parquet
urdyn track model/twin.toml weld.parquet --mode realtime --out cell-7
urdyn track model/twin.toml pack.parquet --mode realtime --out cell-3
urdyn track model/twin.toml day.parquet --filter ekf --out cell-5
urdyn track model/twin.toml monday.parquet --out cell-1
urdyn track model/twin.toml first.parquet --filter ekf --out cell-6
urdyn acknowledge cell-5 friction_increase.elbow_joint
touch -d '2 days ago' cell-6/*
mkdir -p cell-9
urdyn fleet cell-* --out fleet.html
shot="chromium --headless --hide-scrollbars --virtual-time-budget=10000"
$shot --window-size=1180,975 --screenshot=report.png "file://$PWD/cell-7/report.html"
$shot --window-size=1280,1080 --screenshot=fleet.png "file://$PWD/fleet.html"
